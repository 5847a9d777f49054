//! Keys for both sides, by which each knows the other: mutual TLS.

use std::fs;
use std::io::Write;
use std::path::Path;

use palpate::{Error, ErrorKind};
use rcgen::{
    BasicConstraints, CertificateParams, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair, KeyUsagePurpose,
};

/// Names of the machine that listens, beside those that are given: for trying it on one machine.
const HERE: [&str; 3] = ["localhost", "127.0.0.1", "::1"];

/// Writes two folders into `folder`, `global` and `haptic`, one for each machine: its certificate, its key, the authority that both are of,
/// and a `link.toml` that names them. `hosts` are the names or addresses by which the haptic machine reaches the global one.
///
/// The authority's own key is kept nowhere: nobody can make another machine known to these two. The keys do not expire; keys that are there
/// are left alone, so new ones go into another folder.
///
/// # Errors
/// If a name is none, there are keys already, or a file cannot be written.
pub fn make_keys(folder: &Path, hosts: &[String]) -> Result<(), Error> {
    let refused = |error: rcgen::Error| Error::new(ErrorKind::Usage, format!("no such certificate: {error}"));
    let mut authority = CertificateParams::new(Vec::new()).map_err(refused)?;
    authority.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
    authority.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
    authority.distinguished_name.push(DnType::CommonName, "palpate link");
    let authority_key = KeyPair::generate().map_err(refused)?;
    let of_authority = authority.self_signed(&authority_key).map_err(refused)?.pem();
    let issuer = Issuer::new(authority, authority_key);

    let names: Vec<String> = HERE.iter().map(|&name| name.to_owned()).chain(hosts.iter().cloned()).collect();
    let sides = [
        ("global", names, ExtendedKeyUsagePurpose::ServerAuth),
        ("haptic", vec!["haptic.palpate.invalid".to_owned()], ExtendedKeyUsagePurpose::ClientAuth),
    ];
    for (side, names, purpose) in sides {
        let mut params = CertificateParams::new(names).map_err(refused)?;
        params.distinguished_name.push(DnType::CommonName, format!("palpate {side}"));
        params.extended_key_usages = vec![purpose];
        let key = KeyPair::generate().map_err(refused)?;
        let certificate = params.signed_by(&key, &issuer).map_err(refused)?.pem();
        let folder = folder.join(side);
        fs::create_dir_all(&folder).map_err(|error| Error::io(&folder, error))?;
        let toml = format!(
            "# The keys of the {side} machine, for `--config`.\n[tls]\nauthority = \"authority.pem\"\ncertificate = \"{side}.pem\"\nkey = \"{side}.key\"\n"
        );
        write(&folder.join(format!("{side}.key")), &key.serialize_pem())?;
        write(&folder.join(format!("{side}.pem")), &certificate)?;
        write(&folder.join("authority.pem"), &of_authority)?;
        write(&folder.join("link.toml"), &toml)?;
    }
    Ok(())
}

/// Writes a file that only its owner can read; one that is there is left alone.
fn write(path: &Path, text: &str) -> Result<(), Error> {
    let mut options = fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let file = options.open(path).and_then(|mut file| file.write_all(text.as_bytes()));
    file.map_err(|error| Error::io(path, error))
}
