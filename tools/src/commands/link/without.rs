//! What the link's commands are without the feature `link`: a line that says how to get it.

use palpate::session::SessionBuilder;
use palpate::{Error, ErrorKind};

use super::{AccessArgs, KeysArgs, ServeArgs};

fn missing(what: &str) -> Error {
    let message = "this palpate was built without the link to other computers: build it with \
                   `cargo install --path tools --features link`";
    Error::new(ErrorKind::Usage, message).at(what)
}

/// Says that there is no link.
///
/// # Errors
/// Always.
pub fn global_over(_: SessionBuilder, _: &str, _: &AccessArgs) -> Result<SessionBuilder, Error> {
    Err(missing("--global"))
}

/// Says that there is no link.
///
/// # Errors
/// Always.
pub fn serve(_: &ServeArgs) -> Result<(), Error> {
    Err(missing("palpate serve"))
}

/// Says that there is no link.
///
/// # Errors
/// Always.
pub fn keys(_: &KeysArgs) -> Result<(), Error> {
    Err(missing("palpate link keys"))
}
