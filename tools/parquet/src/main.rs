//! `palpate-parquet LOG --topic TOPIC --out FILE`: one topic of a log as an Apache Parquet table.
//!
//! It is a program of its own because the `parquet` crate takes a minute to build. Exit code 0 on success, 2 on a usage or input
//! error, 1 if the table cannot be written.

mod table;

use std::io::BufWriter;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use palpate::Error;
use palpate_cli::{WindowArgs, export_to_file};

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
            eprintln!("error: {error}");
            ExitCode::from(if error.kind().is_input() { 2 } else { 1 })
        }
    }
}

fn run(args: &Args) -> Result<(), Error> {
    export_to_file(&args.log, &args.topic, &args.window, &args.out, |columns, file| {
        ParquetTable::new(columns, BufWriter::new(file))
    })
}
