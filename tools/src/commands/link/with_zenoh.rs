//! The link's commands, over zenoh.

use std::cell::Cell;

use palpate::Error;
use palpate::link::Hello;
use palpate::session::{Session, SessionBuilder};
use palpate_link::{Access, Event, GlobalSide};

use super::super::{files, progress, shared};
use super::{AccessArgs, KeysArgs, ServeArgs};

fn access(args: &AccessArgs) -> Result<Access, Error> {
    let access = args.config.as_deref().map_or_else(|| Ok(Access::default()), Access::read)?;
    Ok(if args.insecure { access.insecure() } else { access })
}

/// Takes the global models of a session from `address`.
///
/// # Errors
/// If the address is none, or not allowed.
pub fn global_over(builder: SessionBuilder, address: &str, args: &AccessArgs) -> Result<SessionBuilder, Error> {
    Ok(builder.global_over(GlobalSide::at(address, &access(args)?)?))
}

/// Runs global models for a haptic machine until it is interrupted.
///
/// # Errors
/// Input errors of the scene, or an address that is not allowed or taken.
pub fn serve(args: &ServeArgs) -> Result<(), Error> {
    let name = shared::name_of(&args.scene);
    let mut scene = progress::load(&args.scene)?;
    if let Some(model) = args.model {
        scene = scene.with_model(model);
    }
    if let Some(out) = &args.out {
        files::keep_inputs(&files::inputs_of(&args.scene, &scene), out)?;
    }
    // One that is made is begun or refused before the next one is made.
    let begun = Cell::new(0);
    let make = || {
        let builder = Session::from_scene(scene.clone());
        let builder = if args.no_cache { builder.forget_bases() } else { builder };
        let log = args.out.iter().map(|out| palpate_view::numbered(out, begun.get() + 1));
        log.fold(builder, SessionBuilder::log).build_global().map_err(|error| error.at(&name))
    };
    let access = access(&args.access)?;
    let interrupt = shared::waits()?;
    let tell = |event| {
        begun.set(begun.get() + u32::from(matches!(event, Event::Began(_))));
        show(&name, &args.listen, event);
    };
    palpate_link::serve(make, &args.listen, &access, || interrupt.came(), tell)
}

fn show(name: &str, address: &str, event: Event) {
    let lines = match event {
        Event::Listening => vec![format!("listens at {address}; Ctrl-C ends it")],
        Event::Began(machines) => machines.iter().map(come).collect(),
        Event::Came(machine) => vec![come(&machine)],
        Event::Refused(error) => vec![format!("a haptic machine is refused: {error}")],
        Event::Ended(summary) => {
            let _ = shared::print(&summary.to_string());
            vec!["the session is over".to_owned()]
        }
        _ => return,
    };
    for line in lines {
        // Whoever does not read this is none the worse for it.
        let _ = shared::print(&format!("{name}: {}\n", palpate::printable(&line)));
    }
}

/// Who has come, in words.
fn come(machine: &Hello) -> String {
    let (ms, own) = (1e3 * machine.round_trip.as_secs_f64(), machine.own_tools().map(|tool| &machine.tools[tool].0));
    let named: Vec<String> = own.filter(|name| !name.is_empty()).map(|name| format!(" {name:?}")).collect();
    let with = if named.is_empty() { "" } else { " with" };
    format!("a haptic machine has come{with}{}, round trip {ms:.1} ms", named.join(" and"))
}

/// Makes keys for both machines.
///
/// # Errors
/// If a name is none, there are keys already, or a file cannot be written.
pub fn keys(args: &KeysArgs) -> Result<(), Error> {
    palpate_link::make_keys(&args.folder, &args.host)?;
    let folder = shared::name_of(&args.folder);
    shared::print(&format!(
        "{folder}/global is for the machine of `palpate serve`, {folder}/haptic for the one of the device: carry each there by a safe \
         way, and name its link.toml by --config\n"
    ))
}
