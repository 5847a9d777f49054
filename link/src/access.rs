//! Who may speak with whom: addresses, keys, and what of zenoh is switched on.

use std::net::IpAddr;
use std::path::{Path, PathBuf};

use palpate::{Error, ErrorKind};
use zenoh::Config;

/// What `ZENOH_RUNTIME` has to be in the environment before the first thread of a program starts that uses `tls/`; the command `palpate` sets it.
///
/// Zenoh reads and writes a TLS connection on two threads at once, which is unsound and breaks it within seconds where both sides send all the
/// time (its issue 2557). This has both done on one thread.
pub const TLS_RUNTIME: &str = "(rx: (handover: tx))";

/// A peer from which nothing has come for so long (ms) is gone.
pub(crate) const LEASE_MS: u32 = 2000;

/// What a message over zenoh may come to at most (bytes): a little more than any of the engine's.
const MOST_BYTES: usize = palpate::link::LARGEST + 1024;

/// The keys of one side, and what is allowed without any.
///
/// ```
/// use palpate_link::{Access, GlobalSide};
///
/// // Whoever is on the way would read and steer.
/// assert!(GlobalSide::at("tcp/big-machine:7447", &Access::default()).is_err());
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Access {
    /// The keys, without which there is no TLS.
    tls: Option<Tls>,
    /// Plain TCP to another machine is allowed.
    is_insecure: bool,
}

/// The files of a `link.toml`, by their paths.
#[derive(Clone, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Tls {
    /// The authority that both sides' certificates are of (PEM).
    authority: PathBuf,
    /// The certificate of this side (PEM).
    certificate: PathBuf,
    /// Its key (PEM).
    key: PathBuf,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    tls: Tls,
}

impl Access {
    /// Reads the keys' paths from a `link.toml`, as [`make_keys`](crate::make_keys) writes it; they begin in its folder.
    ///
    /// # Errors
    /// If it cannot be read, is none, or names a file that is not there.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = std::fs::read_to_string(path).map_err(|error| Error::io(path, error))?;
        let wrong =
            |error: toml::de::Error| Error::new(ErrorKind::Usage, error.message()).at(path.display().to_string());
        let File { mut tls } = toml::from_str(&text).map_err(wrong)?;
        let folder = std::path::absolute(path).map_err(|error| Error::io(path, error))?;
        for file in [&mut tls.authority, &mut tls.certificate, &mut tls.key] {
            *file = folder.parent().unwrap_or(Path::new("")).join(&*file);
            std::fs::metadata(&*file).map_err(|error| Error::io(file, error))?;
        }
        Ok(Self { tls: Some(tls), ..Self::default() })
    }

    /// Allows plain TCP to other machines too: whoever is on the way reads and steers.
    #[must_use]
    pub fn insecure(mut self) -> Self {
        self.is_insecure = true;
        self
    }

    /// How zenoh is configured for the side that listens at `address`.
    pub(crate) fn listening(&self, address: &str) -> Result<Config, Error> {
        let address = self.allowed(address)?;
        self.config(&[
            ("mode", "\"peer\"".to_owned()),
            ("listen/endpoints", format!("[\"{address}\"]")),
            ("listen/exit_on_failure", "true".to_owned()),
            // Closing a connection that said nothing takes zenoh 4 ms, in which it reads from none: of 200 at once the force would fade.
            ("transport/unicast/accept_pending", "8".to_owned()),
            ("transport/unicast/accept_timeout", "2000".to_owned()),
        ])
    }

    /// How zenoh is configured for the side that connects to `address`.
    pub(crate) fn connecting(&self, address: &str) -> Result<Config, Error> {
        let address = self.allowed(address)?;
        self.config(&[
            ("mode", "\"client\"".to_owned()),
            ("connect/endpoints", format!("[\"{address}\"]")),
            ("connect/timeout_ms", "2000".to_owned()),
            ("connect/exit_on_failure", "true".to_owned()),
            ("connect/retry", "{ period_init_ms: 50, period_max_ms: 50, period_increase_factor: 1 }".to_owned()),
            ("transport/unicast/open_timeout", "2000".to_owned()),
        ])
    }

    fn config(&self, own: &[(&str, String)]) -> Result<Config, Error> {
        let path = |path: &Path| format!("{:?}", path.display().to_string());
        let mut all = own.to_vec();
        let common = [
            // Nobody is looked for, and nobody else is told of.
            ("scouting/multicast/enabled", "false"),
            ("scouting/gossip/enabled", "false"),
            ("timestamping/enabled", "false"),
            ("adminspace/enabled", "false"),
        ];
        all.extend(common.map(|(key, value)| (key, value.to_owned())));
        all.push(("transport/link/tx/lease", LEASE_MS.to_string()));
        // Who pushes into a dead connection waits no longer (us) than it takes to notice that. A line that is only slow is not broken: one that
        // loses packets, or has just begun over a long way, may take nothing for a second.
        let pushes_for = (1000 * LEASE_MS).to_string();
        all.push(("transport/link/tx/queue/congestion_control/block/wait_before_close", pushes_for));
        all.push(("transport/link/rx/max_message_size", MOST_BYTES.to_string()));
        if let Some(Tls { authority, certificate, key }) = &self.tls {
            for (name, file) in [
                ("transport/link/tls/root_ca_certificate", authority),
                ("transport/link/tls/listen_certificate", certificate),
                ("transport/link/tls/listen_private_key", key),
                ("transport/link/tls/connect_certificate", certificate),
                ("transport/link/tls/connect_private_key", key),
            ] {
                all.push((name, path(file)));
            }
            all.push(("transport/link/tls/enable_mtls", "true".to_owned()));
        }
        let mut config = Config::default();
        for (key, value) in &all {
            let refused = |error| Error::new(ErrorKind::Runtime, format!("zenoh refuses {key} = {value}: {error}"));
            config.insert_json5(key, value).map_err(refused)?;
        }
        Ok(config)
    }

    /// `address`, if this side may use it.
    fn allowed<'a>(&self, address: &'a str) -> Result<&'a str, Error> {
        let wrong = |message: String| Err(Error::new(ErrorKind::Usage, message).at(address));
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "._-:[]/".contains(c);
        let parts = address.split_once('/').and_then(|(protocol, rest)| Some((protocol, rest.rsplit_once(':')?)));
        let Some((protocol, (host, port))) = parts.filter(|_| address.chars().all(is_plain)) else {
            return wrong("must be PROTOCOL/HOST:PORT, such as tls/big-machine:7447 or tcp/127.0.0.1:7447".to_owned());
        };
        if host.is_empty() || host.contains('/') || port.parse::<u16>().is_err() {
            return wrong("must have a host and a port, such as tls/big-machine:7447".to_owned());
        }
        match protocol {
            "tls" if self.tls.is_none() => wrong(
                "needs keys: make them with `palpate link keys DIR`, and name its link.toml by --config".to_owned(),
            ),
            "tls" if std::env::var_os("ZENOH_RUNTIME").is_none_or(|runtime| runtime != TLS_RUNTIME) => wrong(format!(
                "needs ZENOH_RUNTIME='{TLS_RUNTIME}' in the environment before the program starts: without it zenoh breaks the connection"
            )),
            "tls" => Ok(address),
            "tcp" if self.is_insecure || is_here(host) => Ok(address),
            "tcp" => {
                let message = "is plain TCP to another machine, where whoever is on the way reads and steers: use tls/ with keys \
                               of `palpate link keys DIR`, or say --insecure";
                wrong(message.to_owned())
            }
            other => wrong(format!("{other} is no protocol of a link: use tls, or tcp on this machine")),
        }
    }
}

/// True for an address of this machine that no other one reaches.
fn is_here(host: &str) -> bool {
    let address: Result<IpAddr, _> = host.trim_start_matches('[').trim_end_matches(']').parse();
    host == "localhost" || address.is_ok_and(|address| address.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_tcp_leaves_this_machine_only_if_that_is_asked_for() {
        let none = Access::default();
        for here in ["tcp/127.0.0.1:7447", "tcp/localhost:1", "tcp/[::1]:7447", "tcp/127.8.0.1:0"] {
            assert_eq!(none.allowed(here).unwrap(), here);
        }
        for (there, why) in [
            ("tcp/0.0.0.0:7447", "--insecure"),
            ("tcp/[::]:7447", "--insecure"),
            ("tcp/big-machine:7447", "--insecure"),
            ("tcp/localhost.evil.example:7447", "--insecure"),
            ("tls/big-machine:7447", "link keys"),
            ("udp/127.0.0.1:7447", "no protocol"),
            ("tcp/127.0.0.1:70000", "port"),
            ("tcp/:7447", "host"),
            ("7447", "PROTOCOL"),
            ("tcp/127.0.0.1:7447#iface=eth0", "PROTOCOL"),
            ("tcp/127.0.0.1:1\",\"tcp/0.0.0.0:1", "PROTOCOL"),
        ] {
            let error = none.allowed(there).unwrap_err();
            assert!(error.to_string().contains(why), "{error}");
        }
        assert!(none.clone().insecure().allowed("tcp/0.0.0.0:7447").is_ok());
    }

    #[test]
    fn zenoh_takes_what_it_is_told() {
        let access = Access::default();
        assert!(access.listening("tcp/127.0.0.1:0").is_ok() && access.connecting("tcp/127.0.0.1:1").is_ok());
    }
}
