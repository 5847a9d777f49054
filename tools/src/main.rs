//! The command `palpate`.

use std::process::ExitCode;

fn main() -> ExitCode {
    #[cfg(feature = "link")]
    one_thread_for_tls();
    palpate_cli::main()
}

/// A TLS connection is sound only if zenoh reads and writes it on one thread, which it is told by the environment alone.
#[cfg(feature = "link")]
fn one_thread_for_tls() {
    let is_tls = |argument: std::ffi::OsString| argument.to_string_lossy().contains("tls/");
    if std::env::args_os().any(is_tls) && std::env::var_os("ZENOH_RUNTIME").is_none() {
        // SAFETY: no other thread runs yet that could read the environment.
        unsafe { std::env::set_var("ZENOH_RUNTIME", palpate_cli::TLS_RUNTIME) };
    }
}
