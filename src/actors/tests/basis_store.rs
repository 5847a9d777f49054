use super::*;
use crate::model::body::{Block, Body};
use crate::model::mesh::Face;
use std::fs::File;

fn body() -> (RestingBody, Vec<u32>) {
    let block = Block::builder([5; 3], [0.05; 3]).fix(Face::ZMin).build().unwrap();
    let resting = RestingBody::new(&block).unwrap();
    let mut patch = Vec::new();
    block.patch(&[block.surface().triangles.len() as u32 - 5], [2, 2, 1], &mut patch);
    (resting, patch)
}

/// What the store has for `patch`.
fn get(store: &mut BasisStore, resting: &RestingBody, patch: &[u32]) -> Option<Basis> {
    Reduction::new(resting, patch, store.states).map(|reduction| store.get(resting, reduction).unwrap())
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<_> = fs::read_dir(folder).unwrap().map(|file| file.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn what_was_computed_is_read_again_and_damage_is_computed_again() {
    let (resting, patch) = body();
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path().join("bases");
    let mut store = BasisStore::new(10, Some(folder.clone()));
    let first = get(&mut store, &resting, &patch);
    assert_eq!(files(&folder).len(), 1);
    assert_eq!(store.read(&resting, &patch), first);
    for file in files(&folder) {
        fs::write(file, b"no basis").unwrap();
    }
    assert!(!store.has_complained);
    assert_eq!(store.read(&resting, &patch), None);
    assert!(store.has_complained);
    assert_eq!(get(&mut store, &resting, &patch), first);
    // Check that what has no end is as good as damaged.
    for file in files(&folder) {
        fs::remove_file(&file).unwrap();
        std::os::unix::fs::symlink("/dev/zero", &file).unwrap();
    }
    assert_eq!(get(&mut store, &resting, &patch), first);
    for (count, states) in [9, 11].into_iter().enumerate() {
        let mut other = BasisStore { states, ..store.clone() };
        assert_ne!(get(&mut other, &resting, &patch), first);
        assert_eq!(files(&folder).len(), count + 2, "another size, another file");
    }
}

#[test]
fn many_writers_leave_one_whole_file() {
    let (resting, patch) = body();
    let folder = tempfile::tempdir().unwrap();
    let store = BasisStore::new(10, Some(folder.path().to_owned()));
    let basis = get(&mut store.clone(), &resting, &patch).unwrap();
    std::thread::scope(|scope| {
        for _ in 0..4 {
            let (mut store, resting, basis, patch) = (store.clone(), &resting, &basis, &patch);
            scope.spawn(move || {
                for _ in 0..50 {
                    store.keep(resting, basis);
                    assert_eq!(store.read(resting, patch).as_ref(), Some(basis));
                }
                assert!(!store.has_complained);
            });
        }
    });
    assert_eq!(files(folder.path()).len(), 1);
}

#[test]
fn the_oldest_make_room_and_nothing_else_is_touched() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let write = |name: &str, age_s: u64| {
        let file = File::create(at(name)).unwrap();
        file.set_len(100).unwrap();
        file.set_modified(SystemTime::now() - Duration::from_secs(age_s)).unwrap();
    };
    for (name, age_s) in [("a.basis", 30), ("b.basis", 20), ("c.basis", 10)] {
        write(name, age_s);
    }
    write("notes.txt", 9000);
    write("x.1-0.part", 20);
    write("y.1-0.part", 9000);
    make_room(folder.path(), 350).unwrap();
    let left = |names: &[&str]| names.iter().all(|name| at(name).exists());
    assert!(left(&["b.basis", "c.basis", "notes.txt", "x.1-0.part"]), "{:?}", files(folder.path()));
    assert!(!at("a.basis").exists() && !at("y.1-0.part").exists());
    make_room(folder.path(), 0).unwrap();
    assert_eq!(files(folder.path()).len(), 2, "what is no basis, and one in the making");
}

#[test]
fn a_folder_that_cannot_be_is_complained_of_once() {
    let (resting, patch) = body();
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("file"), b"").unwrap();
    let mut store = BasisStore::new(10, Some(folder.path().join("file/bases")));
    assert!(get(&mut store, &resting, &patch).is_some() && store.has_complained);
}

/// Windows of a large body look alike: the second basis is that of the first, also where both were kept by runs that met them in another
/// order.
#[test]
fn what_was_kept_stands_for_what_is_like_it_as_if_it_had_been_made() {
    let block = Block::builder([30, 30, 6], [0.29, 0.29, 0.05]).fix(Face::ZMin).build().unwrap();
    let patch = |x: usize| {
        let mut nodes = Vec::new();
        block.patch(&[block.surface().at_node(block.lattice().id([x, 15, 5]))[0]], [2, 2, 1], &mut nodes);
        nodes
    };
    let patches = [patch(14), patch(15)];
    let folder = tempfile::tempdir().unwrap();
    let in_order = |order: [usize; 2], folder: Option<&Path>| {
        let resting = RestingBody::new(&block).unwrap();
        let mut store = BasisStore::new(8, folder.map(Path::to_owned));
        order.map(|place| {
            let is_known = Reduction::new(&resting, &patches[place], 8).unwrap().is_known();
            (is_known, get(&mut store, &resting, &patches[place]))
        })
    };
    for order in [[0, 1], [1, 0]] {
        let expected = in_order(order, None);
        assert_eq!(expected.each_ref().map(|(is_known, _)| *is_known), [false, true], "the second is like the first");
        assert!(in_order(order, Some(folder.path())) == expected, "cold");
        assert!(in_order(order, Some(folder.path())) == expected, "warm");
    }
    assert_eq!(files(folder.path()).len(), 2, "each by the run that met it first");
}
