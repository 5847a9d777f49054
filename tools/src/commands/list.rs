//! `palpate list`: the scenes that are built in.

use palpate::Error;
use palpate::report::Page;
use palpate::scene::BuiltIn;

use super::shared;

/// Prints the name of each with what happens in it.
///
/// # Errors
/// If standard output cannot be written.
pub fn run() -> Result<(), Error> {
    let mut page = Page::default();
    for scene in BuiltIn::all() {
        page.line(scene.name().to_owned());
        page.named("", &scene.about());
    }
    page.line(String::new());
    page.line("palpate run NAME, palpate view NAME, palpate compare NAME".to_owned());
    shared::print(&page.text)
}
