//! Configuration file: a broker, and the cabinets whose services are read.

use std::collections::BTreeSet;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use didim::files::{TextError, read_text};
use serde::Deserialize;

/// Maximum number of cabinets; one machine serves fewer.
const MAX_CABINETS: usize = 500;
/// Maximum length of a cabinet name, in characters.
const MAX_NAME_LENGTH: usize = 64;
/// Mode bits of a file that other users can read or write.
const OTHERS_READABLE: u32 = 0o006;

/// Configuration of the program: the broker, the topics and the cabinets.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Configuration {
    /// First part of every topic.
    #[serde(default = "default_prefix")]
    pub(crate) prefix: String,
    /// Folder of the ledgers, which record the acknowledged messages.
    #[serde(default = "default_state")]
    pub(crate) state_directory: PathBuf,
    /// Broker that receives the messages.
    pub(crate) broker: Broker,
    /// The cabinets whose services are read.
    pub(crate) cabinets: Vec<CabinetSection>,
}

/// Settings of an MQTT broker.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Broker {
    /// Address of the broker, as `host:port`.
    pub(crate) address: Address,
    /// User name at the broker.
    pub(crate) user: Option<String>,
    /// File with the user's password.
    pub(crate) password_file: Option<PathBuf>,
    /// File with the certificate of the authority that signed the broker's certificate (PEM). If it
    /// is set, the connection is encrypted.
    pub(crate) ca_file: Option<PathBuf>,
    /// Contents of the password file and of the certificate file.
    #[serde(skip)]
    pub(crate) secrets: Secrets,
}

/// Contents of the files that the section of the broker names.
#[derive(Clone, Default)]
pub(crate) struct Secrets {
    pub(crate) password: Option<String>,
    pub(crate) ca: Option<String>,
}

/// Hides the password in debug output.
impl core::fmt::Debug for Secrets {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Secrets")
    }
}

/// Host name and port of the broker.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub(crate) struct Address {
    pub(crate) host: String,
    pub(crate) port: u16,
}

impl TryFrom<String> for Address {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let wrong =
            || format!("`{text}` is no address; write host and port, as `broker.plant:1883`");
        let (host, port) = text.rsplit_once(':').ok_or_else(wrong)?;
        let bare = host.strip_prefix('[').and_then(|host| host.strip_suffix(']')).unwrap_or(host);
        let port = port.parse().map_err(|_| wrong())?;
        if bare.is_empty() || bare.contains('/') || port == 0 {
            return Err(wrong());
        }
        Ok(Self { host: host.to_owned(), port })
    }
}

/// Settings of a cabinet and its service.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CabinetSection {
    /// Name of the cabinet, used in topics and as the name of the client at the broker.
    pub(crate) name: String,
    /// Folder of the service's sockets.
    #[serde(default = "default_runtime")]
    pub(crate) runtime_directory: PathBuf,
    /// Folder of the service's results.
    #[serde(default = "default_results")]
    pub(crate) state_directory: PathBuf,
}

fn default_prefix() -> String {
    "didim".into()
}

fn default_state() -> PathBuf {
    "/var/lib/didim-publish".into()
}

fn default_runtime() -> PathBuf {
    didim::cell::ServiceSection::default().runtime_directory
}

fn default_results() -> PathBuf {
    didim::cell::ServiceSection::default().state_directory
}

/// Reason why a configuration cannot be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ConfigurationError {
    /// A file cannot be read.
    #[error("cannot read {}: {source}; check path and permissions", path.display())]
    File {
        /// Path of the file.
        path: PathBuf,
        /// Error of the read.
        source: TextError,
    },
    /// The file is not valid TOML, or a key is unknown or missing.
    #[error("{}: {problem}", path.display())]
    Format {
        /// Path of the file.
        path: PathBuf,
        /// Error of the parser, with line and key.
        problem: toml::de::Error,
    },
    /// A value is not allowed.
    #[error("{}: {key}: {problem}", path.display())]
    Value {
        /// Path of the file.
        path: PathBuf,
        /// Key of the value.
        key: &'static str,
        /// Problem with the value, and its remedy.
        problem: String,
    },
}

impl Configuration {
    /// Reads the configuration file and the files that it names.
    ///
    /// # Errors
    /// [`ConfigurationError`] if a file cannot be read or a value cannot be used.
    pub(crate) fn read(path: &Path) -> Result<Self, ConfigurationError> {
        let text = |path: &Path| {
            read_text(path)
                .map_err(|source| ConfigurationError::File { path: path.to_owned(), source })
        };
        let mut configuration: Self = toml::from_str(&text(path)?)
            .map_err(|problem| ConfigurationError::Format { path: path.to_owned(), problem })?;
        configuration.check_values().map_err(|(key, problem)| ConfigurationError::Value {
            path: path.to_owned(),
            key,
            problem,
        })?;
        let Broker { password_file, ca_file, secrets, .. } = &mut configuration.broker;
        if let Some(file) = password_file {
            let password = text(file)?.trim_end_matches(['\r', '\n']).to_owned();
            secrets.password = Some(password);
        }
        secrets.ca = ca_file.as_deref().map(text).transpose()?;
        Ok(configuration)
    }

    fn check_values(&self) -> Result<(), (&'static str, String)> {
        let levels = self.prefix.split('/');
        if !levels.clone().all(is_name) {
            let problem = format!(
                "`{}` is no beginning of a topic; use letters, digits, `-`, `_`, `.`, and `/` \
                between levels",
                self.prefix
            );
            return Err(("prefix", problem));
        }
        let Broker { user, password_file, ca_file, .. } = &self.broker;
        if password_file.is_some() && user.is_none() {
            let problem = "there is none, and a password file; name the user at the broker";
            return Err(("broker.user", problem.into()));
        }
        if let Some(file) = password_file {
            let mode = file.metadata().map(|data| data.permissions().mode()).unwrap_or_default();
            if mode & OTHERS_READABLE != 0 {
                let file = file.display();
                let problem = format!("every user may read {file}; run `chmod o-rw {file}`");
                return Err(("broker.password_file", problem));
            }
        }
        if ca_file.is_some() && !cfg!(feature = "tls") {
            let problem = "this build has no TLS; the Debian package has, and so has a build with \
                           `cargo build --release -p didim-publish --features tls`";
            return Err(("broker.ca_file", problem.into()));
        }
        let cabinets = self.cabinets.len();
        if !(1..=MAX_CABINETS).contains(&cabinets) {
            let problem = format!("there are {cabinets}; name 1 to {MAX_CABINETS}");
            return Err(("cabinets", problem));
        }
        let mut names = BTreeSet::new();
        for CabinetSection { name, .. } in &self.cabinets {
            if !is_name(name) || name.len() > MAX_NAME_LENGTH {
                let problem = format!(
                    "`{name}` is no name; use letters, digits, `-`, `_`, `.`, at most \
                    {MAX_NAME_LENGTH} of them"
                );
                return Err(("cabinets.name", problem));
            }
            if !names.insert(name) {
                let problem = format!("two cabinets are `{name}`; give each its own name");
                return Err(("cabinets.name", problem));
            }
        }
        Ok(())
    }
}

/// Returns true if the text can be one level of a topic and the beginning of a file name.
fn is_name(text: &str) -> bool {
    let fits = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    !text.is_empty() && !text.starts_with('.') && text.chars().all(fits)
}

#[cfg(test)]
mod tests {
    use std::fs::Permissions;

    use super::*;

    const GOOD: &str =
        "[broker]\naddress = \"localhost:1883\"\n[[cabinets]]\nname = \"cabinet-1\"\n";

    fn read(text: &str) -> Result<Configuration, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("publish.toml");
        let password = folder.path().join("password");
        std::fs::write(&path, text.replace("FOLDER", folder.path().to_str().unwrap())).unwrap();
        std::fs::write(&password, "secret\n").unwrap();
        std::fs::set_permissions(&password, Permissions::from_mode(0o640)).unwrap();
        Configuration::read(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn what_is_not_said_is_where_the_service_has_it() {
        let read = read(GOOD).unwrap();
        assert_eq!(read.prefix, "didim");
        assert_eq!(read.broker.address, Address { host: "localhost".into(), port: 1883 });
        assert_eq!(read.cabinets[0].runtime_directory, Path::new("/run/didim"));
        assert_eq!(read.cabinets[0].state_directory, Path::new("/var/lib/didim"));
    }

    #[test]
    fn a_password_is_read_and_not_shown() {
        let user =
            "address = \"localhost:1883\"\nuser = \"a\"\npassword_file = \"FOLDER/password\"";
        let read = read(&GOOD.replace("address = \"localhost:1883\"", user)).unwrap();
        assert_eq!(read.broker.secrets.password.as_deref(), Some("secret"));
        assert!(!format!("{read:?}").contains("secret\""));
    }

    #[test]
    fn what_is_wrong_is_named_with_a_remedy() {
        let broker = "address = \"localhost:1883\"";
        let config_with = |more: &str| GOOD.replace(broker, &format!("{broker}\n{more}"));
        for (text, said) in [
            (GOOD.replace("address", "adress"), "unknown field `adress`"),
            (GOOD.replace(":1883", ""), "write host and port"),
            (GOOD.replace("cabinet-1", "a/b"), "use letters, digits"),
            (GOOD.replace("cabinet-1", "#"), "use letters, digits"),
            (format!("{GOOD}[[cabinets]]\nname = \"cabinet-1\"\n"), "two cabinets"),
            (format!("prefix = \"a//b\"\n{GOOD}"), "`/` between levels"),
            (format!("cabinets = []\n{}", &GOOD[..GOOD.find("[[").unwrap()]), "name 1 to 500"),
            (config_with("password_file = \"FOLDER/password\""), "name the user"),
            (
                config_with("user = \"a\"\npassword_file = \"FOLDER/none\""),
                "check path and permissions",
            ),
            (config_with("user = \"a\"\npassword_file = \"FOLDER/publish.toml\""), "chmod o-rw"),
        ] {
            let error = read(&text).unwrap_err();
            assert!(error.contains(said) && error.contains("/"), "{error}");
        }
    }
}
