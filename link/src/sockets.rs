//! The sockets of a link, which zenoh keeps to itself, and how long they wait for a peer that is gone.
//!
//! Closing a connection with something on its way, zenoh waits ten seconds for the peer to take it, and one of the two threads by which it reads
//! does nothing else meanwhile. So a cable that is put in again would bring a force only when TCP next tries the dead connections, which is
//! later and later. With a limit of their own the system has given them up before.

use std::net::{SocketAddr, ToSocketAddrs};

/// Where `address`, such as `tls/big-machine:7447`, leads to; nowhere if that cannot be told now.
pub(crate) fn places(address: &str) -> Vec<SocketAddr> {
    let place = address.split_once('/').map_or("", |(_, place)| place);
    place.to_socket_addrs().map(Iterator::collect).unwrap_or_default()
}

/// Lets connections to these places, and those that are accepted there, end once nothing has been acknowledged for as long as a peer may be
/// silent. Where the system has no such thing, or does not allow it, they only end later.
pub(crate) fn limit_waiting(places: &[SocketAddr]) {
    #[cfg(target_os = "linux")]
    for socket in linux::sockets(places) {
        let _ = rustix::net::sockopt::set_tcp_user_timeout(&socket, crate::access::LEASE_MS);
    }
    #[cfg(not(target_os = "linux"))]
    let _ = places;
}

#[cfg(target_os = "linux")]
mod linux {
    use std::fs::DirEntry;
    use std::net::SocketAddr;
    use std::os::fd::{OwnedFd, RawFd};

    use rustix::net::{getpeername, getsockname, sockopt};
    use rustix::process::{PidfdFlags, PidfdGetfdFlags, getpid, pidfd_getfd, pidfd_open};

    /// Those of this process that are connected to these places or accept there: other descriptors of the same sockets.
    pub(super) fn sockets(places: &[SocketAddr]) -> Vec<OwnedFd> {
        let Ok(own) = pidfd_open(getpid(), PidfdFlags::empty()) else { return Vec::new() };
        let Ok(all) = std::fs::read_dir("/proc/self/fd") else { return Vec::new() };
        let numbers = all.filter_map(|one| number(&one.ok()?));
        let sockets = numbers.filter_map(|number| pidfd_getfd(&own, number, PidfdGetfdFlags::empty()).ok());
        sockets.filter(|socket| end(socket).is_some_and(|place| places.contains(&place))).collect()
    }

    /// Of a descriptor that is a socket. With another descriptor of a file the locks of this process on it would end.
    fn number(descriptor: &DirEntry) -> Option<RawFd> {
        let of = std::fs::read_link(descriptor.path()).ok()?;
        let number = descriptor.file_name().to_str()?.parse().ok()?;
        of.to_str()?.starts_with("socket:").then_some(number)
    }

    /// The other end of a connection, or the place where they are accepted.
    fn end(socket: &OwnedFd) -> Option<SocketAddr> {
        let accepts = sockopt::socket_acceptconn(socket).ok()?;
        let end = if accepts { getsockname(socket).ok()? } else { getpeername(socket).ok()?? };
        end.try_into().ok()
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use std::net::{TcpListener, TcpStream};

    use rustix::net::sockopt::tcp_user_timeout;

    use super::*;
    use crate::access::LEASE_MS;

    #[test]
    fn connections_get_a_limit_at_both_ends_and_others_keep_theirs() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let place = listener.local_addr().unwrap();
        limit_waiting(&[place]);
        let there = TcpStream::connect(place).unwrap();
        let (here, _) = listener.accept().unwrap();
        assert_eq!(tcp_user_timeout(&here).unwrap(), LEASE_MS, "as of the socket that accepted it");
        assert_eq!(tcp_user_timeout(&there).unwrap(), 0);
        limit_waiting(&places(&format!("tcp/{place}")));
        assert_eq!(tcp_user_timeout(&there).unwrap(), LEASE_MS);
        assert_eq!(tcp_user_timeout(TcpListener::bind("127.0.0.1:0").unwrap()).unwrap(), 0);
        assert_eq!(linux::sockets(&[place]).len(), 2);
    }
}
