//! Reference page of the findings of a verdict, generated from their catalogue.

use didim_identification::identification::{CATALOGUE, CatalogueRow, Severity, Use};

use super::page::{Block, Page};

pub(super) fn page() -> Page {
    let text = |text: &str| Block::Text(text.to_owned());
    let heading = |text: &str| Block::Heading(text.to_owned());
    Page {
        name: "didim-findings",
        section: 7,
        document: "findings.md",
        title: "findings of a verdict, with their remedies",
        blocks: vec![
            text(
                "A finding is blocking, explanatory or advisory. A blocking finding makes the \
                 result unusable for the uses that it names: a figure exceeds its limit, or the \
                 data or the method are unusable. An explanatory finding may be the cause. It is \
                 listed before the figures that it may explain, and it does not block any use. \
                 Where the figures of the required uses are within their limits, it is a note. An \
                 advisory finding is for information only.",
            ),
            text(
                "JSON has the sentences in `verdict.reasons` and `verdict.notes`, and every \
                 finding as data in `verdict.findings`: `code`, `severity` (`blocking`, \
                 `explanatory` or `advisory`), `uses` (those that it blocks or explains), \
                 `subject` (`joints`, `motors`, `links` or `parameters`), `figure`, `limit`, \
                 `unit` (`1` for shares, ratios and counts), `significance`, `set` and `message`. \
                 Codes keep their names; messages may change. A code that only an earlier version \
                 had is read as `other`. In the tables `…`, N, M and P replace values.",
            ),
            text(
                "`significance` is there for another reading of the data, a contradicted value, a \
                 controller, an unmodelled effect, coloured residuals, a negative parameter and \
                 parameters that differ from those of the positions. It has `probability`, that \
                 one test has such an outcome although nothing is wrong, and `tests`, their number \
                 in this verdict. Their product is at least the probability of a false finding of \
                 this kind. For another reading of the data, `probability` is the odds against it \
                 by Schwarz's criterion. The other findings compare a figure with its limit, or \
                 are counts.",
            ),
            text(
                "`set` is the key to change in the cell or robot file, if the data ask for another \
                 value: `file`, `line` (of the section if the key is missing, 1 if that is missing \
                 too), `key` and `value`. \
                 Entries of lists count from 1, as in `bus.drives[2].position.zero`. It exists for \
                 scales, zeros, signs and delays of drives on a bus, of columns in `[data]` and of \
                 didim's own columns (`[table]`) \
                 (of bags for the efforts and delays), for `excludes` and \
                 `identification.friction`, and for gravity, drive inertia, couplings and \
                 geometry of a robot file or of `[urdf]`. Zeros and gains need a motor that turns \
                 one joint. Signals of several kinds, such as a bag and a table, have it where \
                 one key serves all.",
            ),
            heading("Blocking"),
            table(Severity::Blocking),
            heading("Explanatory"),
            table(Severity::Explanatory),
            heading("Advisory"),
            table(Severity::Advisory),
            heading("Refusals"),
            text(
                "Some data give no result: a window with a lost sample, values far beyond a limit \
                 of the robot, or an iteration that does not converge. The command prints the \
                 reason and ends with exit code 1. The service counts the window under `refused`.",
            ),
        ],
        files: &[],
        see_also: &[
            ["didim-identify(1)", "../method/verdict.md", "figures and limits of a verdict"],
            ["didim-cell(5)", "cell-file.md", "cell file"],
            ["didim-status(1)", "status.md", "status of the service"],
        ],
    }
}

/// Returns the table of the findings of one severity. The table of advisory findings has no column
/// of uses.
fn table(severity: Severity) -> Block {
    let has_uses = severity != Severity::Advisory;
    let row = |row: &CatalogueRow| {
        let messages: Vec<String> = row.messages.iter().map(|text| format!("`{text}`")).collect();
        let uses: Vec<&str> = row.uses.iter().map(|usage| usage.name()).collect();
        // A finding that affects all uses does not list contact detection, which has no verdict of
        // yes or no.
        let uses =
            if uses.len() + 1 == Use::ALL.len() { "all".to_owned() } else { uses.join(", ") };
        let mut cells = vec![messages.join(", "), format!("`{}`", row.code.name())];
        cells.extend(has_uses.then_some(uses));
        cells.extend([row.meaning.to_owned(), row.remedy.to_owned()]);
        cells
    };
    let head: &[&str] = match has_uses {
        true => &["message begins with", "code", "uses", "meaning", "what to do"],
        false => &["message begins with", "code", "meaning", "what to do"],
    };
    Block::Table {
        head: head.iter().map(|cell| (*cell).to_owned()).collect(),
        rows: CATALOGUE.iter().filter(|of| of.severity == severity).map(row).collect(),
    }
}
