//! What a server is told.

use std::net::{IpAddr, Ipv4Addr};

/// The address, the port and the title of a server.
///
/// ```
/// use palpate_view::Options;
///
/// let options = Options { port: 8080, ..Options::default() };
/// assert!(options.listen.is_loopback(), "other machines see nothing unless they are let in");
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// The address to listen on: this machine's own by default. Another one lets other machines in, unencrypted: whoever reads the
    /// network reads the token.
    pub listen: IpAddr,
    /// The port; 0 for one that is free.
    pub port: u16,
    /// The name of what is shown, at the top of the page.
    pub title: String,
}

impl Default for Options {
    /// A free port of this machine, for nobody else.
    fn default() -> Self {
        Self { listen: IpAddr::V4(Ipv4Addr::LOCALHOST), port: 0, title: "palpate".to_owned() }
    }
}
