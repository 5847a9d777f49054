//! How options of `palpate export` that do not belong together are refused.

use crate::support::Folder;

#[test]
fn options_that_do_not_belong_together_are_refused_in_one_line() {
    let folder = Folder::new();
    folder.succeed(&["run", "scene.toml", "--virtual", "--duration", "0.04", "--out", "good.mcap"]);
    let before = folder.files();
    let cases: &[(&[&str], &[&str])] = &[
        (&[], &["--topic"]),
        (&["--format", "csv", "--topic", "/force", "--group", "local"], &["--group", "hgrm"]),
        (&["--format", "hgrm"], &["--group local --figure lateness"]),
        (&["--format", "hgrm", "--group", "local"], &["--figure"]),
        (&["--format", "hgrm", "--figure", "lateness"], &["--group"]),
        (&["--format", "hgrm", "--group", "local", "--figure", "force"], &["force", "lateness", "jitter"]),
        (&["--format", "hgrm", "--group", "loc", "--figure", "jitter"], &["good.mcap", "\"loc\"", "global", "local"]),
        (&["--format", "hgrm", "--topic", "/timing/local"], &["--topic", "csv"]),
        (&["--format", "chrome-trace", "--topic", "/force"], &["--topic", "chrome-trace"]),
        (&["--format", "chrome-trace", "--figure", "jitter"], &["--figure", "hgrm"]),
        (&["--topic", "/force", "--from", "2", "--to", "1"], &["--from 2 --to 1"]),
        (&["--topic", "/force", "--from", "-1"], &["--from", "-1"]),
        (&["--topic", "/force", "--to", "nan"], &["--to", "NaN"]),
        (&["--topic", "/force", "--to", "soon"], &["--to", "soon"]),
        (&["--topic", "/force", "--format", "parquet"], &["palpate-parquet", "export CSV"]),
    ];
    for (options, words) in cases {
        let called = folder.call(&[&["export", "good.mcap", "--out", "new.file"], *options].concat());
        assert_eq!((called.code, &*called.out), (Some(2), ""), "{called:?}");
        let is_one_line = called.err.trim_end().lines().count() == 1 && called.err.starts_with("error: ");
        assert!(is_one_line && words.iter().all(|word| called.err.contains(word)), "{words:?} in {:?}", called.err);
        assert_eq!(folder.files(), before, "{options:?}");
    }
}
