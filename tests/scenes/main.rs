//! Scene files: what they say, what is refused and with which words, and whole scenes of tissue in virtual time.

mod errors;
mod files;
mod limits;
mod tissue;
mod toml_text;
mod tool_path;
