//! Man pages and shell completions, made from the command line's own description.

use std::io;
use std::path::PathBuf;

use clap::Args;
use clap_complete::Shell;

use super::CliError;
use super::output::write_text;

/// A generated file: its path below the folder, and its text.
pub type Generated = (String, String);

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The folder for `man` and `completions`; created where it is missing
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
}

/// Writes man pages and completions, for whoever packages the program.
pub(super) fn execute(arguments: &Arguments, command: clap::Command) -> Result<(), CliError> {
    let pages =
        man_pages(command.clone()).and_then(|pages| Ok([pages, completions(command)?].concat()));
    for (path, text) in pages.map_err(CliError::failed)? {
        let path = arguments.out.join(path);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|error| CliError::in_file(folder, error))?;
        }
        write_text(&path, &text)?;
    }
    Ok(())
}

/// Every man page: `didim(1)`, one for each command, and one for each action of those that have some.
///
/// # Errors
/// None but of the memory that is written to.
pub fn man_pages(mut whole: clap::Command) -> io::Result<Vec<Generated>> {
    whole.build();
    let mut pages = Vec::new();
    add_pages(&whole, "didim", &mut pages)?;
    Ok(pages)
}

/// The page of a command, and those of the commands below it, which it refers to.
fn add_pages(command: &clap::Command, name: &str, pages: &mut Vec<Generated>) -> io::Result<()> {
    // Its own name is what is looked for; the line to type has a space.
    let mut own = command.clone().display_name(name.to_owned());
    if own.find_subcommand("help").is_some() {
        own = own.mut_subcommand("help", |help| help.hide(true));
    }
    pages.push((format!("man/{name}.1"), page(own)?));
    for sub in
        command.get_subcommands().filter(|sub| sub.get_name() != "help" && !sub.is_hide_set())
    {
        add_pages(sub, &format!("{name}-{}", sub.get_name()), pages)?;
    }
    Ok(())
}

/// Completions for bash, zsh and fish, under the names that these look for.
///
/// # Errors
/// A text that is not UTF-8, which none is.
pub fn completions(mut command: clap::Command) -> io::Result<Vec<Generated>> {
    [
        (Shell::Bash, "completions/bash/didim"),
        (Shell::Zsh, "completions/zsh/_didim"),
        (Shell::Fish, "completions/fish/didim.fish"),
    ]
    .into_iter()
    .map(move |(shell, path)| {
        let mut text = Vec::new();
        clap_complete::generate(shell, &mut command, "didim", &mut text);
        Ok((path.to_owned(), utf8(text)?))
    })
    .collect()
}

/// What is behind every page: what a shell sees of an end, and where more is written.
const TRAILER: &str = r".SH EXIT STATUS
.TP
0
done
.TP
1
the command was refused or failed; the reason is on stderr
.TP
2
wrong usage
.TP
78
a cell, robot or layout file is wrong
.TP
130
interrupted
.PP
A result that is not applicable is no failure of the command: read its verdict.
.SH FILES
.TP
/usr/share/didim/config
example cells, robots and layouts
.TP
/var/lib/didim, /run/didim
results and sockets of the service, unless the cell names others
.SH SEE ALSO
/usr/share/doc/didim
";

fn page(command: clap::Command) -> io::Result<String> {
    let mut text = Vec::new();
    // Without a date: the same program makes the same page.
    clap_mangen::Man::new(command)
        .section("1")
        .manual("didim")
        .source(format!("didim {}", env!("CARGO_PKG_VERSION")))
        .render(&mut text)?;
    text.extend_from_slice(TRAILER.as_bytes());
    utf8(text)
}

fn utf8(text: Vec<u8>) -> io::Result<String> {
    String::from_utf8(text).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
}
