//! A reference page, and its two output formats: Markdown and a man page.

/// A reference page, independent of its output format. Text between backticks is literal.
pub(super) struct Page {
    pub(super) name: &'static str,
    pub(super) section: u8,
    /// File name of the page in `docs/reference`.
    pub(super) document: &'static str,
    pub(super) title: &'static str,
    pub(super) blocks: Vec<Block>,
    /// Files, each with its description.
    pub(super) files: &'static [[&'static str; 2]],
    /// Related man pages: name of the man page, page in `docs`, and title of that page.
    pub(super) see_also: &'static [[&'static str; 3]],
}

pub(super) enum Block {
    Heading(String),
    Text(String),
    /// Table: the first column has the term, the last column its meaning.
    Table {
        head: Vec<String>,
        rows: Vec<Vec<String>>,
    },
    /// Example: a part of a file.
    Example(String),
}

impl Page {
    pub(super) fn markdown(&self) -> String {
        let mut text = format!("# {}\n\n", capitalise(self.title));
        text.push_str(
            "<!-- Written by `didim manual --out target/manual`, which tests hold to the program: \
             change crates/cli/src/command/manual or the types that read the file, not this page. \
             -->\n\n",
        );
        text.push_str(&format!("The man page `{}({})` is the same.\n\n", self.name, self.section));
        for block in &self.blocks {
            text.push_str(&match block {
                Block::Heading(heading) => format!("## {heading}\n\n"),
                Block::Text(words) => format!("{words}\n\n"),
                Block::Table { head, rows } => markdown_table(head, rows),
                Block::Example(example) => format!("```toml\n{example}\n```\n\n"),
            });
        }
        if !self.see_also.is_empty() {
            let links = self.see_also.iter().filter(|[_, document, _]| !document.is_empty());
            let links: Vec<String> =
                links.map(|[_, document, title]| format!("[{title}]({document})")).collect();
            text.push_str(&format!("See also: {}.\n", links.join(", ")));
        }
        text
    }

    pub(super) fn to_man(&self) -> String {
        let (name, section, title) = (roff(self.name), self.section, roff(self.title));
        let version = env!("CARGO_PKG_VERSION");
        // The page has no date, so that the same program always generates the same page.
        let mut text = format!(
            ".TH {name} {section} \"\" \"didim {version}\" didim\n.SH NAME\n{name} \\- \
            {title}\n.SH DESCRIPTION\n"
        );
        for block in &self.blocks {
            text.push_str(&match block {
                Block::Heading(heading) => format!(".SH \"{}\"\n", roff(heading)),
                Block::Text(words) => format!(".PP\n{}\n", roff(words)),
                Block::Table { head, rows } => man_table(head, rows),
                Block::Example(example) => man_example(example),
            });
        }
        text.push_str(&man_files(self.files));
        text.push_str(&man_see_also(self.see_also.iter().map(|[page, _, _]| *page)));
        text
    }
}

/// Formats the section `FILES`. Returns an empty text if there are no files.
pub(super) fn man_files(files: &[[&str; 2]]) -> String {
    if files.is_empty() {
        return String::new();
    }
    let files =
        files.iter().map(|[file, what]| format!(".TP\n\\fI{}\\fR\n{}\n", roff(file), roff(what)));
    format!(".SH FILES\n{}", files.collect::<String>())
}

/// Formats the section `SEE ALSO`, with pages such as `didim-cell(5)` and the documentation.
pub(super) fn man_see_also<'a>(pages: impl Iterator<Item = &'a str>) -> String {
    let pages = pages.map(|page| match page.split_once('(') {
        Some((name, section)) => format!(".BR {} ({section} ,\n", roff(name)),
        None => format!(".B {}\n", roff(page)),
    });
    format!(".SH SEE ALSO\n{}/usr/share/doc/didim\n", pages.collect::<String>())
}

/// Formats the lines of an example without changes, indented.
pub(super) fn man_example(example: &str) -> String {
    let lines: String = example.lines().map(|line| format!("{}\n", roff_line(line))).collect();
    format!(".PP\n.RS 4\n.nf\n{lines}.fi\n.RE\n")
}

fn markdown_table(head: &[String], rows: &[Vec<String>]) -> String {
    let line = |cells: &[String]| {
        let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
        format!("| {} |\n", cells.join(" | ")).replace("|  |", "| |")
    };
    let rule = format!("|{}\n", "---|".repeat(head.len()));
    let rows: String = rows.iter().map(|row| line(row)).collect();
    format!("{}{rule}{rows}\n", line(head))
}

/// Formats each row as a term, with the middle columns in brackets and the meaning below.
fn man_table(head: &[String], rows: &[Vec<String>]) -> String {
    rows.iter()
        .map(|row: &Vec<String>| {
            let (Some(term), Some(meaning)) = (row.first(), row.last()) else {
                return String::new();
            };
            let between = head.iter().zip(row).skip(1).take(row.len().saturating_sub(2));
            let between: Vec<String> = between
                .filter(|(_, cell)| !cell.is_empty())
                .map(|(head, cell)| match head.as_str() {
                    "default" if cell.starts_with('`') => format!("default {cell}"),
                    "default" if !cell.starts_with("required") && cell != "one of these" => {
                        format!("left out: {cell}")
                    }
                    _ => cell.clone(),
                })
                .collect();
            let between = if between.is_empty() {
                String::new()
            } else {
                format!("  ({})", between.join("; "))
            };
            format!(".TP\n{}{}\n{}\n", roff(term), roff(&between), roff(meaning))
        })
        .collect()
}

/// Formats a text with the parts between backticks in bold.
pub(super) fn roff(text: &str) -> String {
    let escaped = text.split('`').enumerate().map(|(k, part)| match k % 2 {
        0 => escape(part),
        _ => format!("\\fB{}\\fR", escape(part)),
    });
    protect_dot(escaped.collect())
}

fn roff_line(line: &str) -> String {
    protect_dot(escape(line))
}

fn escape(text: &str) -> String {
    // The escapes make a literal hyphen a minus sign, and keep literal quotes and carets unchanged.
    text.replace('\\', "\\e")
        .replace('-', "\\-")
        .replace('\'', "\\(aq")
        .replace('"', "\\(dq")
        .replace('^', "\\(ha")
        .replace('~', "\\(ti")
}

/// Protects a leading dot, which roff would interpret as a request.
fn protect_dot(line: String) -> String {
    if line.starts_with('.') { format!("\\&{line}") } else { line }
}

fn capitalise(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
