//! What the example is asked for.

/// What is run, and what is made from it.
#[derive(Debug, Default, PartialEq)]
pub struct Asked {
    /// How the names of the cases begin; the quick ones if there is none.
    pub names: Vec<String>,
    /// Every case.
    pub all: bool,
    /// The table in the docs.
    pub docs: bool,
    /// What bounds are made from, in place of the table.
    pub bounds: bool,
}

impl Asked {
    /// Reads `arguments`, in which names are those of `cases`.
    ///
    /// # Errors
    /// If there is no such case or option, or two exclude each other.
    pub fn read(arguments: impl Iterator<Item = String>, cases: &[&str]) -> Result<Self, String> {
        let mut asked = Self::default();
        for argument in arguments {
            match argument.as_str() {
                "--all" => asked.all = true,
                "--docs" => asked.docs = true,
                "--bounds" => asked.bounds = true,
                name if cases.iter().any(|case| case.starts_with(name)) => asked.names.push(argument),
                _ => {
                    let cases = cases.join(", ");
                    return Err(format!(
                        "{argument:?}: must be --all, --docs, --bounds or how one of these begins: {cases}"
                    ));
                }
            }
        }
        match asked.bounds && asked.docs {
            true => Err("--bounds makes no table for --docs: leave one of them out".to_owned()),
            false => Ok(asked),
        }
    }
}
