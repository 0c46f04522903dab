//! Load values with their uncertainty.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::equation::LoadSums;
use crate::identification::problem::PayloadLimits;

/// Value with its standard deviation, in one unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct UncertainValue {
    /// The value.
    pub value: f64,
    /// Its standard deviation.
    pub standard_deviation: f64,
}

impl UncertainValue {
    /// Returns the distance from a given value, in standard deviations.
    pub fn deviations_from(&self, configured: f64) -> f64 {
        (self.value - configured) / self.standard_deviation
    }
}

/// Identifiable sum of the ten load parameters for this arm, in SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoadParameter {
    /// Expression of the sum: `m`, or `xx - yy`.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Its value.
    #[serde(flatten)]
    pub found: UncertainValue,
}

impl LoadParameter {
    /// Returns each sum with its value and standard deviation.
    pub(super) fn list(
        sums: &LoadSums,
        values: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> Vec<Self> {
        let found = (0..values.len()).map(|k| UncertainValue {
            value: values[k],
            standard_deviation: covariance[(k, k)].max(0.0).sqrt(),
        });
        let named = sums.names().into_iter().zip(sums.units()).zip(found);
        named.map(|((name, unit), found)| Self { name, unit, found }).collect()
    }
}

/// Mass, centre and inertia of the load. A value is `None` if it is identifiable only in a sum with
/// others, or not at all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Load {
    /// Mass \[kg\].
    pub mass_kg: Option<UncertainValue>,
    /// Centre of mass in the frame of the last link \[m\]; `None` if no mass is detected.
    pub centre_m: [Option<UncertainValue>; 3],
    /// Inertia about the centre of mass, xx xy xz yy yz zz, along the axes of the frame of the last
    /// link \[kg·m²\]. Entry xy is minus the integral of xy.
    pub inertia_kg_m2: [Option<UncertainValue>; 6],
}

/// Physically consistent body nearest to the estimate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoadBody {
    /// Mass \[kg\].
    pub mass_kg: f64,
    /// Centre of mass in the frame of the last link \[m\].
    pub centre_m: [f64; 3],
    /// Inertia about the centre of mass, xx xy xz yy yz zz \[kg·m²\].
    pub inertia_kg_m2: [f64; 6],
    /// True if all ten parameters are identifiable and already physically consistent. The body is
    /// then the estimate itself.
    pub is_the_estimate: bool,
    /// Squared distance from the estimate, in the metric of its covariance.
    pub cost: f64,
    /// Limit below which the cost of the true body stays in 99 % of cases (χ²).
    pub cost_limit: f64,
}

impl Load {
    /// Creates the load from the sums and their covariance. Uncertainties of values that are not
    /// sums are propagated to first order.
    pub(super) fn from_sums(
        sums: &LoadSums,
        values: &DVector<f64>,
        covariance: &DMatrix<f64>,
        limits: &PayloadLimits,
    ) -> Self {
        // Indices among the ten load parameters.
        const MX_INDEX: usize = 6;
        const M_INDEX: usize = 9;

        let (ten, covariance) = sums.load_parameters(values, covariance);
        // Value with its uncertainty, from its gradient with respect to all load parameters that it
        // depends on.
        let uncertain = |value: f64, gradient: &[(usize, f64)]| {
            let is_identifiable = gradient.iter().all(|(k, _)| sums.separate_sum(*k).is_some());
            let both = |(i, a): &(usize, f64)| -> f64 {
                gradient.iter().map(|(j, b)| a * b * covariance[(*i, *j)]).sum()
            };
            let variance: f64 = gradient.iter().map(both).sum();
            is_identifiable
                .then(|| UncertainValue { value, standard_deviation: variance.max(0.0).sqrt() })
        };
        let m = ten[M_INDEX];
        let mass_kg = uncertain(m, &[(M_INDEX, 1.0)]);
        let Some(mass) = mass_kg.filter(|mass| mass.is_seen(limits)) else {
            return Self { mass_kg, centre_m: [None; 3], inertia_kg_m2: [None; 6] };
        };
        let c = [0, 1, 2].map(|k| ten[MX_INDEX + k] / mass.value);
        let centre = |k: usize| uncertain(c[k], &[(MX_INDEX + k, 1.0 / m), (M_INDEX, -c[k] / m)]);
        // I − m (cᵀc 1 − c cᵀ)
        let inertia = |entry: usize, [i, j]: [usize; 2]| {
            if i == j {
                let [a, b] = [(i + 1) % 3, (i + 2) % 3];
                let square = c[a].powi(2) + c[b].powi(2);
                let terms =
                    [(MX_INDEX + a, -2.0 * c[a]), (MX_INDEX + b, -2.0 * c[b]), (M_INDEX, square)];
                uncertain(ten[entry] - m * square, &[(entry, 1.0), terms[0], terms[1], terms[2]])
            } else {
                let terms = [(MX_INDEX + i, c[j]), (MX_INDEX + j, c[i]), (M_INDEX, -c[i] * c[j])];
                uncertain(
                    ten[entry] + m * c[i] * c[j],
                    &[(entry, 1.0), terms[0], terms[1], terms[2]],
                )
            }
        };
        let places = [[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]];
        Self {
            mass_kg,
            centre_m: [0, 1, 2].map(centre),
            inertia_kg_m2: core::array::from_fn(|entry| inertia(entry, places[entry])),
        }
    }
}

impl UncertainValue {
    /// True if the value is significantly above 0.
    pub fn is_seen(&self, limits: &PayloadLimits) -> bool {
        self.value > limits.deviations * self.standard_deviation
    }

    /// True if the value differs significantly from 0, in either direction.
    pub fn differs_from_none(&self, limits: &PayloadLimits) -> bool {
        self.value.abs() > limits.deviations * self.standard_deviation
    }
}
