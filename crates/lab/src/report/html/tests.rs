use didim_identification::identification::Method;

use super::specimen::{
    HOSTILE, assert_closed, assert_numbers_only, assert_stands_by_itself, cell, identification,
    origin,
};
use super::*;
use crate::comparison::{
    Comparison, Framework, MethodResult, SCHEMA, Trial, TrueParameter, trials,
};

/// Returns a comparison in which all methods have the same result with every optional part; the
/// last method failed.
fn comparison() -> Comparison {
    let methods = trials(&Method::ALL, true)
        .into_iter()
        .map(|trial: Trial| {
            let identified = identification();
            let failed = trial.method == Method::Didim && trial.framework == Framework::Strict;
            let (estimate, fit, failure) = if failed {
                (None, None, Some(HOSTILE.to_owned()))
            } else {
                (Some(identified.estimate), Some(identified.fit), None)
            };
            MethodResult { trial, estimate, failure, failure_kind: None, elapsed_ms: 1.0, fit }
        })
        .collect();
    let truth = TrueParameter { name: "zz1r".to_owned(), unit: "kg·m²", value: 1.25 };
    let (robot, truth) = (HOSTILE.to_owned(), Some(vec![truth]));
    Comparison { schema: SCHEMA, robot, methods, agreement: vec![], held_out: vec![], truth }
}

fn html() -> String {
    let (cell, comparison, origin) = (cell(), comparison(), origin());
    let view = View { comparison: &comparison, published: None, outcomes: &[], shows_times: false };
    ComparisonReport { cell: &cell, view, origin: &origin, scenario: None }.to_html()
}

#[test]
fn it_stands_by_itself_whatever_is_in_it() {
    let html = html();
    assert_stands_by_itself(&html);
    assert_closed(&html);
    assert_numbers_only(&html);
    assert!(!html.contains("<script") && html.contains("&lt;script&gt;alert"));
}

#[test]
fn a_method_without_a_result_is_a_verdict_and_no_column() {
    let html = html();
    let (verdicts, rest) = html.split_once("<h2>Estimates</h2>").unwrap();
    assert_eq!(verdicts.matches("<dt>").count(), 8);
    assert!(verdicts.contains("<dd class=\"verdict-word\">failed</dd>"));
    let header = rest.split_once("<h2>Estimates, strict").unwrap().1;
    let header = header.split_once("</thead>").unwrap().0;
    assert!(header.contains(">CLOE</th>") && !header.contains("DIDIM"), "{header}");
    // Six joints for each of seven results, and the convergence of each result.
    assert_eq!(html.matches("<svg class=\"panel\"").count(), 7 * 6 + 7);
}
