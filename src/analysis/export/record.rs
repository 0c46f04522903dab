//! A consistent model as JSON.

use didim_dynamics::robot::Parameter as RobotParameter;
use didim_formats::LeftOut;
use didim_identification::feasibility::{Judgement, Outcome, ValueSource};
use serde::Serialize;

use super::model::ConsistentModel;

/// Version of the record's layout.
const SCHEMA: u32 = 1;

/// The record of a consistent model. Its JSON layout is a contract.
#[derive(Debug, Serialize)]
struct Record<'a> {
    schema: u32,
    robot: &'a str,
    /// Name of the method that identified the result.
    method: &'a str,
    /// Source of the prior, which determines the parameters that the data do not.
    prior: String,
    /// λ, the weight of the prior.
    prior_weight: f64,
    /// J, the squared distance between the consistent parameters and the result, in standard
    /// deviations of the result.
    cost: f64,
    /// Smallest J of any physically consistent parameters, regardless of the prior.
    least_cost: f64,
    /// Limit that the smallest J of the true parameters stays below (χ², 99 %).
    cost_limit: f64,
    judgement: Judgement,
    /// Number of base parameters that the data determine.
    effective_parameters: f64,
    parameters: Vec<Parameter<'a>>,
    #[serde(rename = "bodies")]
    link_bodies: Vec<LinkBody>,
    /// Shift of each base parameter, in its standard deviations.
    shifts: Vec<Shift<'a>>,
    /// Parts of the model that the output does not contain.
    left_out: Vec<String>,
    /// Uses that the cell requires, but that the verdict refuses.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    refusals: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Parameter<'a> {
    name: &'a str,
    unit: &'static str,
    value: f64,
    /// Standard deviation from data and prior together.
    standard_deviation: f64,
    /// Source of the value: the data, the prior or a combination.
    decided_by: ValueSource,
    share_of_data: f64,
}

#[derive(Debug, Serialize)]
struct LinkBody {
    mass_kg: f64,
    /// Centre of mass in the frame of the link \[m\].
    centre_of_mass_m: [f64; 3],
    /// Inertia about the centre of mass in the order xx xy xz yy yz zz \[kg·m²\].
    inertia_kg_m2: [f64; 6],
    /// Divergence from the prior \[nats\].
    divergence: f64,
}

/// Shift of one base parameter from the result to the consistent model.
#[derive(Debug, Serialize)]
struct Shift<'a> {
    name: &'a str,
    /// Size of the shift, in standard deviations of the parameter \[σ\].
    standard_deviations: f64,
}

impl ConsistentModel<'_> {
    /// Writes the model with its uncertainties as JSON.
    ///
    /// # Errors
    /// Same as [`serde_json::to_string_pretty`].
    pub(super) fn json(&self, left_out: &[LeftOut]) -> Result<String, serde_json::Error> {
        let Outcome { parameters, link_bodies: body_list, shifts, divergence_per_link, .. } =
            &self.outcome;
        let robot = &self.cell.robot;
        let kinds = robot.parameters().parameters().iter();
        let unit = |of: &RobotParameter| of.kind.unit(robot.chain()[of.joint].kind);
        let record = Record {
            schema: SCHEMA,
            robot: robot.name(),
            method: &self.model.method,
            prior: self.outcome.prior.to_string(),
            prior_weight: self.outcome.weight,
            cost: self.outcome.cost,
            least_cost: self.outcome.least_cost,
            cost_limit: self.outcome.threshold,
            judgement: self.outcome.judgement,
            effective_parameters: self.outcome.effective_parameters,
            parameters: parameters
                .iter()
                .zip(kinds)
                .map(|(of, kind)| Parameter {
                    name: &of.name,
                    unit: unit(kind),
                    value: of.value,
                    standard_deviation: of.deviation,
                    decided_by: of.class,
                    share_of_data: of.share_of_data,
                })
                .collect(),
            link_bodies: body_list
                .iter()
                .zip(divergence_per_link)
                .map(|(body, divergence)| {
                    let centre = body.centre_of_mass_m().unwrap_or_default();
                    let j = body.inertia_about_centre().unwrap_or_default();
                    LinkBody {
                        mass_kg: body.mass_kg,
                        centre_of_mass_m: centre.into(),
                        inertia_kg_m2: [
                            j[(0, 0)],
                            j[(0, 1)],
                            j[(0, 2)],
                            j[(1, 1)],
                            j[(1, 2)],
                            j[(2, 2)],
                        ],
                        divergence: *divergence,
                    }
                })
                .collect(),
            shifts: shifts
                .iter()
                .map(|of| Shift { name: &of.name, standard_deviations: of.deviations })
                .collect(),
            left_out: left_out.iter().map(ToString::to_string).collect(),
            refusals: self.model.refusals(&self.cell.options.required_uses),
        };
        serde_json::to_string_pretty(&record).map(|text| text + "\n")
    }
}
