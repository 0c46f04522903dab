//! Prediction errors of each method on held-out samples.

use super::table::{Cell, Table, percent_text};
use super::view::View;
use crate::comparison::{HeldOut, title};

pub(super) fn table(view: &View<'_>) -> Option<Table> {
    let held_out = &view.comparison.held_out;
    let blocks = held_out.first()?.blocks;
    let joints =
        held_out.iter().find_map(|of| Some(of.held_out.as_ref()?.relative_error_per_joint.len()));
    let mut header = ["", "in sample", "held out"].map(str::to_owned).to_vec();
    header.extend((1..=joints.unwrap_or(0)).map(|joint| format!("joint {joint}")));
    let failures: String = held_out
        .iter()
        .filter_map(|of| Some(format!(" {}: {}.", title(of.method), of.failure.as_ref()?)))
        .collect();
    Some(Table {
        title: "Held-out errors".to_owned(),
        note: format!(
            "‖τ − Xθ‖ / ‖τ‖ of all joints together, along the measured motion, over {blocks} \
             consecutive blocks, each predicted with the estimate from the other blocks; in \
             sample, with the estimate from all.{failures}"
        ),
        rows: held_out.iter().map(|of| row(of, header.len())).collect(),
        header,
    })
}

fn row(of: &HeldOut, columns: usize) -> Vec<Cell> {
    let error = |share: f64| Cell::from(percent_text(share, 3));
    let mut row = vec![Cell::from(title(of.method))];
    if let (Some(held_out), Some(in_sample)) = (&of.held_out, &of.in_sample) {
        row.extend([in_sample.relative_error, held_out.relative_error].map(error));
        row.extend(held_out.relative_error_per_joint.iter().copied().map(error));
    }
    row.resize_with(columns, Cell::missing);
    row
}
