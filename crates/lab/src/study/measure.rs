//! Figures of a grid cell that are displayed as heat maps.

use super::summary::CellSummary;
use didim::text::significant_digits;

/// Figure of the runs of one method in one cell of the grid.
pub(super) struct Measure {
    /// File name of the heat map.
    pub(super) file: &'static str,
    /// Title of the heat map, with the unit of the figure.
    pub(super) title: &'static str,
    /// Meaning of the figure.
    pub(super) meaning: &'static str,
    /// Function that returns the figure; `None` if there is no result.
    pub(super) value: fn(&CellSummary) -> Option<f64>,
    /// Classes of the figure.
    pub(super) scale: &'static Scale,
}

/// Seven classes of values: a value is in the first class whose bound it does not exceed. The last
/// class has no bound.
pub(super) struct Scale {
    pub(super) bounds: [f64; 6],
    /// Names of the classes in the legend.
    pub(super) names: [&'static str; 7],
    /// Significant digits; `None` for whole numbers.
    digits: Option<usize>,
}

const SHARE_SCALE: Scale = Scale {
    bounds: [0.0, 20.0, 40.0, 60.0, 80.0, 99.999],
    names: ["0", "to 20", "to 40", "to 60", "to 80", "to 99", "100"],
    digits: None,
};
const TORQUE_SCALE: Scale = Scale {
    bounds: [0.03, 0.1, 0.3, 1.0, 3.0, 10.0],
    names: ["to 0.03", "to 0.1", "to 0.3", "to 1", "to 3", "to 10", "more"],
    digits: Some(2),
};
const DEVIATION_SCALE: Scale = Scale {
    bounds: [1.2, 1.5, 2.0, 5.0, 10.0, 30.0],
    names: ["to 1.2", "to 1.5", "to 2", "to 5", "to 10", "to 30", "more"],
    digits: Some(2),
};

const SIMULATION_SCALE: Scale = Scale {
    bounds: [0.0, 3.0, 5.0, 8.0, 12.0, 20.0],
    names: ["0", "to 3", "to 5", "to 8", "to 12", "to 20", "more"],
    digits: Some(2),
};

/// All measures with a heat map, in the order of the document.
pub(super) const MEASURES: [Measure; 6] = [
    Measure {
        file: "torque-deviation.svg",
        title: "Torque deviation, median [%]",
        meaning: "‖X(θ̂ − θ)‖ / ‖Xθ‖ along the planned motion: how wrong the model is, in torque",
        value: |cell| Some(100.0 * cell.figures.as_ref()?.torque_deviation_median),
        scale: &TORQUE_SCALE,
    },
    Measure {
        file: "rms-deviation.svg",
        title: "Deviation of the parameters, rms [σ]",
        meaning: "(estimate − truth)/σ over all parameters and results: 1 where σ is what it says",
        value: |cell| Some(cell.figures.as_ref()?.rms_deviation),
        scale: &DEVIATION_SCALE,
    },
    Measure {
        file: "converged.svg",
        title: "Converged [% of the runs]",
        meaning: "runs that gave a result, and no local minimum",
        value: |cell| cell.percent_of_runs(cell.converged),
        scale: &SHARE_SCALE,
    },
    Measure {
        file: "simulations.svg",
        title: "Closed-loop simulations of a result",
        meaning: "on average, those that failed on the way included",
        value: |cell| Some(cell.figures.as_ref()?.simulations),
        scale: &SIMULATION_SCALE,
    },
    Measure {
        file: "applicable.svg",
        title: "Applicable [% of the runs]",
        meaning: "results that the verdict lets pass",
        value: |cell| cell.percent_of_runs(cell.applicable),
        scale: &SHARE_SCALE,
    },
    Measure {
        file: "wrongly-accepted.svg",
        title: "Wrongly accepted [% of the runs]",
        meaning: "wrong results that the verdict lets pass: its misses",
        value: |cell| cell.percent_of_runs(cell.wrongly_accepted),
        scale: &SHARE_SCALE,
    },
];

impl Scale {
    /// Returns the class of a value, counted from 0.
    pub(super) fn value_class(&self, value: f64) -> usize {
        self.bounds.iter().filter(|bound| value > **bound).count()
    }

    /// Formats a value short enough for a cell.
    pub(super) fn format_value(&self, value: f64) -> String {
        match self.digits {
            Some(digits) if value < 100.0 => significant_digits(value, digits),
            // A share of 99.9 % must not be displayed as 100 %, nor a share of 0.1 % as 0 %.
            None if value > 99.0 && value < 100.0 => "99".to_owned(),
            None if value > 0.0 && value < 1.0 => "<1".to_owned(),
            _ if value >= 1e5 => format!("{value:.0e}"),
            _ => format!("{value:.0}"),
        }
    }
}
