//! `palpate serve`, `palpate link keys` and the option `--global`: the two models on two computers.
//!
//! What speaks to the network is compiled with the feature `link` alone.

use std::path::PathBuf;

use palpate::scene::ModelChoice;
use palpate::session::SessionBuilder;
use palpate::{Error, ErrorKind};

use super::shared;

#[cfg_attr(feature = "link", path = "with_zenoh.rs")]
#[cfg_attr(not(feature = "link"), path = "without.rs")]
mod ways;

pub use ways::{keys, serve};

/// Who may speak with whom.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct AccessArgs {
    /// The keys of this machine: a link.toml of `palpate link keys`
    #[arg(long, value_name = "LINK.toml")]
    pub config: Option<PathBuf>,
    /// Allow plain TCP to another machine: whoever is on the way can read and steer
    #[arg(long)]
    pub insecure: bool,
}

/// Where the global models come from, if they are not made here.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct GlobalArgs {
    /// Take the global models from `palpate serve` at this address, such as tls/big-machine:7447 or tcp/127.0.0.1:7447
    #[arg(long = "global", value_name = "ADDRESS")]
    pub address: Option<String>,
    /// The scene's device of this name is at this machine, and those that are not named at another one; may be given again
    #[arg(long, value_name = "NAME", requires = "address")]
    pub device: Vec<String>,
    #[command(flatten)]
    pub access: AccessArgs,
}

impl GlobalArgs {
    /// Refuses what says how to reach a global model elsewhere where none is asked for.
    ///
    /// # Errors
    /// [`ErrorKind::Usage`] if there is something of that kind.
    pub fn check(&self) -> Result<(), Error> {
        let given = [("--config", self.access.config.is_some()), ("--insecure", self.access.insecure)];
        match given.into_iter().find(|(_, is_given)| *is_given && self.address.is_none()) {
            Some((option, _)) => {
                let message =
                    format!("{option} is for a global model elsewhere: add --global ADDRESS, or leave it out");
                Err(Error::new(ErrorKind::Usage, message))
            }
            None => Ok(()),
        }
    }

    /// Lets a session take its global models from there, if they are not made here.
    ///
    /// # Errors
    /// If the address is none, or not allowed.
    pub fn of(&self, builder: SessionBuilder) -> Result<SessionBuilder, Error> {
        let Some(address) = &self.address else { return Ok(builder) };
        ways::global_over(self.device.iter().fold(builder, SessionBuilder::device_here), address, &self.access)
    }
}

/// The arguments of `palpate serve`.
#[derive(Debug, clap::Args)]
pub struct ServeArgs {
    /// A scene file (TOML), or the name of a built-in scene (`palpate list`): the same one as on the haptic machine
    pub scene: PathBuf,
    /// Listen here, such as tls/0.0.0.0:7447 or tcp/127.0.0.1:7447
    #[arg(long, value_name = "ADDRESS")]
    pub listen: String,
    /// Use this local model instead of the scene's own, as on the haptic machine
    #[arg(long, value_name = "NAME", value_parser = shared::choice)]
    pub model: Option<ModelChoice>,
    /// Keep no reduced surroundings from run to run, and take none that were kept
    #[arg(long)]
    pub no_cache: bool,
    /// Also write a log of each session: the first to this file, each after it to a name with its number; overwritten if it exists
    #[arg(long, value_name = "LOG.mcap")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub access: AccessArgs,
}

/// The arguments of `palpate link`.
#[derive(Debug, clap::Args)]
pub struct LinkArgs {
    #[command(subcommand)]
    pub command: LinkCommand,
}

/// What there is to do for a link.
#[derive(Debug, clap::Subcommand)]
pub enum LinkCommand {
    /// Make the keys by which two machines know each other: a folder for each, with a link.toml for --config
    Keys(KeysArgs),
}

/// The arguments of `palpate link keys`.
#[derive(Debug, clap::Args)]
pub struct KeysArgs {
    /// Where to put the two folders, `global` and `haptic`
    pub folder: PathBuf,
    /// A name or an address by which the haptic machine reaches the global one; may be given again
    #[arg(long, value_name = "NAME")]
    pub host: Vec<String>,
}
