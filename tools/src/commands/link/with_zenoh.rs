//! The link's commands, over zenoh.

use palpate::Error;
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
    let mut sessions = 0;
    let make = || {
        let builder = Session::from_scene(scene.clone());
        let builder = if args.no_cache { builder.forget_bases() } else { builder };
        sessions += 1;
        let builder = args.out.iter().fold(builder, |builder, out| builder.log(palpate_view::numbered(out, sessions)));
        builder.build_global().map_err(|error| error.at(&name))
    };
    let access = access(&args.access)?;
    let interrupt = shared::waits()?;
    palpate_link::serve(make, &args.listen, &access, || interrupt.came(), |event| show(&name, &args.listen, &event))
}

fn show(name: &str, address: &str, event: &Event) {
    let line = match event {
        Event::Listening => format!("listens at {address}; Ctrl-C ends it"),
        Event::Came(hello) => {
            let (ms, own) = (1e3 * hello.round_trip.as_secs_f64(), hello.own_tools().map(|tool| &hello.tools[tool].0));
            let named: Vec<String> = own.filter(|name| !name.is_empty()).map(|name| format!(" {name:?}")).collect();
            let with = if named.is_empty() { "" } else { " with" };
            format!("a haptic machine has come{with}{}, round trip {ms:.1} ms", named.join(" and"))
        }
        Event::Refused(error) => format!("a haptic machine is refused: {error}"),
        Event::Ended(summary) => {
            let _ = shared::print(&summary.to_string());
            match (&summary.runtime.fault, &summary.log_error) {
                (Some(fault), _) => format!("the session is over: {fault}"),
                (None, Some(error)) => format!("the session is over; the log is incomplete: {error}"),
                (None, None) => "the session is over".to_owned(),
            }
        }
        _ => return,
    };
    // Whoever does not read this is none the worse for it.
    let _ = shared::print(&format!("{name}: {}\n", palpate::printable(&line)));
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
