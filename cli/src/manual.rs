//! Man pages, reference pages and shell completions, made from the command line's own description and the tables of this room.

mod cell;
mod commands;
mod glossary;
mod page;
mod reference;
mod robot;
#[cfg(test)]
mod tests;

use std::io;
use std::path::PathBuf;

use clap::Args;
use clap_complete::Shell;

use self::commands::{CommandPage, PAGES};
use self::page::{man_example, man_files, man_see_also, roff};
use super::CliError;
use super::output::write_text;

/// A generated file: its path below the folder, and its text.
pub type Generated = (String, String);

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The folder for `man`, `docs` and `completions`; created where it is missing
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
}

/// Writes man pages and completions, for whoever packages the program.
pub(super) fn execute(arguments: &Arguments, command: clap::Command) -> Result<(), CliError> {
    let pages = man_pages(command.clone())
        .and_then(|pages| Ok([pages, completions(command)?, documents()].concat()));
    for (path, text) in pages.map_err(CliError::failed)? {
        let path = arguments.out.join(path);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|error| CliError::in_file(folder, error))?;
        }
        write_text(&path, &text)?;
    }
    Ok(())
}

/// Every man page: `didim(1)`, one for each command, and one for each action of those that have some; the keys of the
/// files, and the names of parameters.
///
/// # Errors
/// None but of the memory that is written to.
pub fn man_pages(mut whole: clap::Command) -> io::Result<Vec<Generated>> {
    whole.build();
    let mut pages = Vec::new();
    add_pages(&whole, "", &mut pages)?;
    pages.extend(
        references().map(|page| (format!("man/{}.{}", page.name, page.section), page.man())),
    );
    Ok(pages)
}

/// The pages of `docs` that say the same as man pages.
pub fn documents() -> Vec<Generated> {
    references().map(|page| (format!("docs/{}", page.document), page.markdown())).collect()
}

fn references() -> impl Iterator<Item = page::Page> {
    [cell::CELL.page(), robot::ROBOT.page(), glossary::page()].into_iter()
}

/// The page of a command, and those of the commands below it, which it refers to; `words` are what is typed behind `didim`.
fn add_pages(command: &clap::Command, words: &str, pages: &mut Vec<Generated>) -> io::Result<()> {
    let name = format!("didim {words}").trim_end().replace(' ', "-");
    // Its own name is what is looked for; the line to type has a space.
    let mut own = command.clone().display_name(name.clone());
    if own.find_subcommand("help").is_some() {
        own = own.mut_subcommand("help", |help| help.hide(true));
    }
    let beside = PAGES.iter().find(|page| page.command == words);
    if let (Some(beside), Some(about)) = (beside, own.get_about().map(ToString::to_string)) {
        own = own.long_about(format!("{about}.\n\n{}", beside.description));
    }
    pages.push((format!("man/{name}.1"), page(own, beside)?));
    for sub in
        command.get_subcommands().filter(|sub| sub.get_name() != "help" && !sub.is_hide_set())
    {
        add_pages(sub, format!("{words} {}", sub.get_name()).trim_start(), pages)?;
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

/// What a shell sees of an end.
const EXIT_STATUS: &str = r".SH EXIT STATUS
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
";

fn page(command: clap::Command, beside: Option<&CommandPage>) -> io::Result<String> {
    let mut text = Vec::new();
    // Without a date: the same program makes the same page.
    clap_mangen::Man::new(command)
        .section("1")
        .manual("didim")
        .source(format!("didim {}", env!("CARGO_PKG_VERSION")))
        .render(&mut text)?;
    let mut text = utf8(text)?;
    if let Some(beside) = beside {
        text.push_str(".SH EXAMPLES\n");
        for [line, what] in beside.examples {
            text.push_str(&format!(".PP\n{}:\n{}", roff(what), man_example(line)));
        }
    }
    text.push_str(EXIT_STATUS);
    if let Some(beside) = beside {
        text.push_str(&man_files(beside.files));
        text.push_str(&man_see_also(beside.see_also.iter().copied()));
    }
    Ok(text)
}

fn utf8(text: Vec<u8>) -> io::Result<String> {
    String::from_utf8(text).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
}
