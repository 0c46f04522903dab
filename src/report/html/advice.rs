//! Insufficient parameters and the motions that improve them.

use maud::{Markup, html};

use super::super::MissingAdvice;
use super::page::{to_sentence, with_code, with_real_minus};
use super::section as framed;

/// Number of columns of the table whose cells are numbers, after the name.
const NUMBERS: usize = 5;

/// Creates the section: a table of the parameters, and a list of the motions.
pub(super) fn section(advice: &MissingAdvice) -> Markup {
    let is_number = |column: usize| (1..=NUMBERS).contains(&column);
    let content = html! {
        p { (to_sentence(advice.introduction.trim_end_matches(':'))) }
        @if !advice.rows.is_empty() {
            div.scroll { table {
                thead { tr {
                    @for (column, heading) in MissingAdvice::HEADER.iter().enumerate() {
                        th.number[is_number(column)] scope="col" { (heading) }
                    }
                } }
                tbody { @for row in &advice.rows { tr {
                    @for (column, cell) in row.iter().enumerate() {
                        @if column == 0 {
                            th scope="row" { (cell) }
                        } @else if is_number(column) {
                            td.number { (with_real_minus(cell)) }
                        } @else {
                            td { (with_code(cell)) }
                        }
                    }
                } } }
            } }
            p { (MissingAdvice::LEGEND) "." }
        }
        @if !advice.joints.is_empty() {
            details {
                summary { "Range of motion of the joints" }
                ul { @for line in &advice.joints { li { (to_sentence(line)) } } }
            }
        }
        @if !advice.motions.is_empty() {
            ol { @for motion in &advice.motions { li {
                (motion.motion)
                ul { @for effect in &motion.effects { li { (effect) } } }
            } } }
        }
        @for remark in &advice.remarks { p { (to_sentence(remark)) } }
    };
    let explanation = "As didim advise says it, for motions within half of the largest speeds and \
                       accelerations.";
    framed("Missing parameters, and motions that identify them", explanation, &content)
}
