//! Who may come in: the token of the address, and the names under which the server may be called.

use std::net::{IpAddr, SocketAddr};

use palpate::{Error, ErrorKind};

/// Bytes of a token: nobody guesses 128 bits.
const TOKEN_BYTES: usize = 16;

/// What a visitor must know, from the part of the address that browsers do not send.
#[derive(Clone)]
pub(crate) struct Token(String);

impl std::fmt::Debug for Token {
    /// Without what it is, which is no matter for a log.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Token")
    }
}

impl Token {
    /// A new one, from the system's own random numbers.
    ///
    /// # Errors
    /// If the system has none.
    pub(crate) fn new() -> Result<Self, Error> {
        let mut bytes = [0_u8; TOKEN_BYTES];
        getrandom::fill(&mut bytes)
            .map_err(|error| Error::new(ErrorKind::Runtime, format!("no random numbers for a token: {error}")))?;
        Ok(Self(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// True if `told` is it. Every byte is compared, whatever the first ones are: the time tells nothing.
    pub(crate) fn is(&self, told: &str) -> bool {
        let differing = self.0.bytes().zip(told.bytes()).fold(0, |sum, (own, told)| sum | (own ^ told));
        self.0.len() == told.len() && differing == 0
    }

    pub(crate) fn text(&self) -> &str {
        &self.0
    }
}

/// The names under which a server may be called. A page of another origin whose name is made to lead here (DNS rebinding) comes
/// under its own name.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hosts(pub(crate) SocketAddr);

impl Hosts {
    /// True if a request for `host` is meant for this server: the machine's own names, or for one that other machines may use any
    /// address in numbers, and the port. A name of the network could be anybody's.
    pub(crate) fn allow(&self, host: &str) -> bool {
        let Some((name, port)) = host.rsplit_once(':') else { return self.0.port() == 80 && self.is_own(host) };
        port.parse() == Ok(self.0.port()) && self.is_own(name)
    }

    fn is_own(&self, name: &str) -> bool {
        if name.eq_ignore_ascii_case("localhost") {
            return true;
        }
        let name = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
        name.parse::<IpAddr>().is_ok_and(|address| address.is_loopback() || !self.0.ip().is_loopback())
    }

    /// True if a page of `origin` is the one that this server gave under the name `host`.
    pub(crate) fn is_same_origin(origin: &str, host: &str) -> bool {
        origin.strip_prefix("http://").is_some_and(|name| name.eq_ignore_ascii_case(host))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_is_long_new_every_time_and_no_part_of_it_will_do() {
        let (one, other) = (Token::new().unwrap(), Token::new().unwrap());
        assert_eq!(one.text().len(), 32);
        assert!(one.is(one.text()) && !one.is(other.text()));
        assert!(!one.is("") && !one.is(&one.text()[..31]) && !one.is(&format!("{}0", one.text())));
    }

    #[test]
    fn only_its_own_names_are_meant_for_it() {
        let own = Hosts("127.0.0.1:8080".parse().unwrap());
        for host in ["127.0.0.1:8080", "localhost:8080", "LocalHost:8080", "[::1]:8080"] {
            assert!(own.allow(host), "{host}");
        }
        for host in ["127.0.0.1", "127.0.0.1:80", "evil.example:8080", "192.168.0.7:8080", "", ":", "localhost:8080@x"]
        {
            assert!(!own.allow(host), "{host}");
        }
        let open = Hosts("0.0.0.0:8080".parse().unwrap());
        assert!(open.allow("192.168.0.7:8080") && !open.allow("evil.example:8080"));
        assert!(Hosts::is_same_origin("http://127.0.0.1:8080", "127.0.0.1:8080"));
        for origin in ["http://evil.example", "https://127.0.0.1:8080", "null", "", "http://127.0.0.1:80800"] {
            assert!(!Hosts::is_same_origin(origin, "127.0.0.1:8080"), "{origin}");
        }
    }
}
