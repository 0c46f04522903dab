//! Man pages, reference pages, JSON Schemas and shell completions, generated from the definition of
//! the command line and the types that read the files.

mod commands;
mod findings;
mod glossary;
mod page;
mod reference;
mod schema;
#[cfg(test)]
mod tests;

use std::io;
use std::path::PathBuf;

use clap::Args;
use clap_complete::Shell;
use didim::archive::store::ResultRecord;
use schemars::schema_for;

use self::commands::{CommandPage, PAGES};
use self::page::{man_example, man_files, man_see_also, roff};
use self::reference::Reference;
use self::schema::FileSchema;
use crate::CliError;
use crate::output::write_text;

/// A generated file: its path relative to the output folder, and its text.
pub type Generated = (String, String);

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The folder for `man`, `docs`, `schema` and `completions`; created if missing
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
}

/// Writes man pages, schemas and completions, for packagers of the program.
pub(super) fn execute(arguments: &Arguments, command: clap::Command) -> Result<(), CliError> {
    let pages = man_pages(command.clone())
        .and_then(|pages| Ok([pages, completions(command)?, documents()?, schemas()].concat()));
    for (path, text) in pages.map_err(CliError::from_failure)? {
        let path = arguments.out.join(path);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|error| CliError::in_file(folder, error))?;
        }
        write_text(&path, &text)?;
    }
    Ok(())
}

/// Creates every man page: `didim(1)`, one for each command, and one for each action of a command.
/// Also creates the reference pages: keys of files, parameter names and findings.
///
/// # Errors
/// A page names a table that its file does not have. A test excludes this error.
pub fn man_pages(mut command: clap::Command) -> io::Result<Vec<Generated>> {
    command.build();
    let mut pages = Vec::new();
    add_pages(&command, "", &mut pages)?;
    let references = references()?;
    pages.extend(
        references
            .iter()
            .map(|page| (format!("man/{}.{}", page.name, page.section), page.to_man())),
    );
    Ok(pages)
}

/// Creates the pages of `docs/reference` and the JSON Schema of a result.
///
/// # Errors
/// A page names a table that its file does not have. A test excludes this error.
pub fn documents() -> io::Result<Vec<Generated>> {
    let document =
        |page: &page::Page| (format!("docs/reference/{}", page.document), page.markdown());
    let mut documents: Vec<Generated> = references()?.iter().map(document).collect();
    documents.push(("docs/reference/result.schema.json".to_owned(), result_schema()));
    Ok(documents)
}

/// Creates the JSON Schemas: those of cell and robot files, with which editors complete and check
/// keys, and that of a result.
pub fn schemas() -> Vec<Generated> {
    let schema = |file: Reference| {
        (format!("schema/{}.schema.json", file.name), file.schema.json(file.title()))
    };
    let mut schemas: Vec<Generated> = files().map(schema).into();
    schemas.push(("schema/didim-result.schema.json".to_owned(), result_schema()));
    schemas
}

/// Creates the JSON Schema of a stored result. `identify --json` prints its `estimate`.
fn result_schema() -> String {
    FileSchema::new(schema_for!(ResultRecord)).without_defaults().json("Result of didim")
}

fn files() -> [Reference; 2] {
    [reference::cell_file(), reference::robot_file()]
}

fn references() -> io::Result<Vec<page::Page>> {
    let mut pages =
        files().iter().map(Reference::page).collect::<Result<Vec<_>, _>>().map_err(invalid_data)?;
    pages.extend([glossary::page(), findings::page()]);
    Ok(pages)
}

fn invalid_data(error: impl Into<Box<dyn core::error::Error + Send + Sync>>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, error)
}

/// Adds the page of a command and the pages of its subcommands, to which it refers. `words` are the
/// words typed after `didim`.
fn add_pages(command: &clap::Command, words: &str, pages: &mut Vec<Generated>) -> io::Result<()> {
    let name = format!("didim {words}").trim_end().replace(' ', "-");
    // People look for the page by its name with hyphens; the usage line has spaces.
    let mut page_command = command.clone().display_name(name.clone());
    if page_command.find_subcommand("help").is_some() {
        page_command = page_command.mut_subcommand("help", |help| help.hide(true));
    }
    let auxiliary_page = PAGES.iter().find(|page| page.command == words);
    if let (Some(auxiliary), Some(about)) =
        (auxiliary_page, page_command.get_about().map(ToString::to_string))
    {
        page_command = page_command.long_about(format!("{about}.\n\n{}", auxiliary.description));
    }
    pages.push((format!("man/{name}.1"), page(page_command, auxiliary_page)?));
    for sub in
        command.get_subcommands().filter(|sub| sub.get_name() != "help" && !sub.is_hide_set())
    {
        add_pages(sub, format!("{words} {}", sub.get_name()).trim_start(), pages)?;
    }
    Ok(())
}

/// Creates completions for bash, zsh and fish, under the names that these shells expect.
///
/// # Errors
/// A generated text is not UTF-8. This error does not occur.
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

/// Section of the man pages about the exit status of the program.
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
3
the work was done, and the answer is no (\-\-require, \-\-limits)
.TP
78
a cell, robot or layout file is wrong
.TP
130
interrupted
.PP
A result that is not usable is no failure of the command: read its verdict, or ask for a use by
\-\-require.
";

fn page(command: clap::Command, auxiliary: Option<&CommandPage>) -> io::Result<String> {
    let mut text = Vec::new();
    // The page has no date, so that the same program always generates the same page.
    clap_mangen::Man::new(command)
        .section("1")
        .manual("didim")
        .source(format!("didim {}", env!("CARGO_PKG_VERSION")))
        .render(&mut text)?;
    let mut text = utf8(text)?;
    if let Some(auxiliary_columns) = auxiliary {
        text.push_str(".SH EXAMPLES\n");
        for [line, what] in auxiliary_columns.examples {
            text.push_str(&format!(".PP\n{}:\n{}", roff(what), man_example(line)));
        }
    }
    text.push_str(EXIT_STATUS);
    if let Some(auxiliary_columns) = auxiliary {
        text.push_str(&man_files(auxiliary_columns.files));
        text.push_str(&man_see_also(auxiliary_columns.see_also.iter().copied()));
    }
    Ok(text)
}

fn utf8(text: Vec<u8>) -> io::Result<String> {
    String::from_utf8(text).map_err(invalid_data)
}
