//! `palpate-parquet LOG --topic TOPIC --out FILE`: one topic of a log as an Apache Parquet table.
//!
//! It is a program of its own because the `parquet` crate takes a minute to build. Exit code 0 on success, 2 on a usage or input
//! error, 1 if the table cannot be written.

mod table;

use std::io::{self, BufWriter, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use palpate::log::LogReader;
use palpate::{Error, printable};
use palpate_cli::{OutputFile, WindowArgs, export_rows, is_turned};

use table::ParquetTable;

/// Write one topic of a log as an Apache Parquet table, with the columns and units of `palpate export`
#[derive(Debug, Parser)]
#[command(version)]
struct Args {
    /// The log to read
    log: PathBuf,
    /// The topic, such as /force or /timing/local
    #[arg(long)]
    topic: String,
    /// The file to write
    #[arg(long)]
    out: PathBuf,
    #[command(flatten)]
    window: WindowArgs,
}

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // A full standard error takes nothing, and nobody is left to tell.
            let _ = writeln!(io::stderr(), "error: {error}");
            ExitCode::from(if error.kind().is_input() { 2 } else { 1 })
        }
    }
}

fn run(args: &Args) -> Result<(), Error> {
    let window = args.window.window()?;
    let mut reader = LogReader::open(&args.log)?;
    let output = OutputFile::create(&args.out, &[&args.log])?;
    let is_turned = is_turned(&args.log, &args.topic)?;
    export_rows(&mut reader, &args.topic, is_turned, &window, |columns| {
        ParquetTable::new(columns, BufWriter::new(&output))
    })?;
    output.finish()?;
    if let Some(damage) = reader.damage() {
        let _ = writeln!(io::stderr(), "warning: {}: {damage}", printable(reader.place()));
    }
    Ok(())
}
