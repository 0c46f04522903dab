//! The options of an identification.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::closed_loop_limits::ClosedLoopLimits;
use super::error::IdentificationError;
use super::fixed::KeptParameters;
use super::limits::VerdictLimits;
use super::method::Method;
use super::payload_limits::PayloadLimits;
use super::search::{CutoffSearch, FrictionSearch};
use super::selection::Selection;
use super::simulation::SimulationOptions;
use super::tolerances::Tolerances;
use super::uses::Use;
use crate::regression::RobustLoss;
use crate::signal::{ParallelDecimation, SecondOrderSections, SignalError, butterworth_low_pass};
use didim_dynamics::control::SimulatedController;
use didim_dynamics::dynamics::BaseParameters;
use didim_dynamics::robot::Robot;

/// The options of an identification, by whatever method, as a cell file states them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Options {
    /// Filter of the positions.
    pub position_filter: PositionFilter,
    /// Filter and decimation of both sides of the equation.
    pub decimation_filter: DecimationFilter,
    /// Names of the essential parameters (`zz1r`, `fv_m6`); every base parameter when left out.
    /// Parameters that are not named are taken as 0, unless they keep their nominal values.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parameters: Option<Vec<String>>,
    /// Parameters that keep the values of the robot file although they are not named.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub keep_nominal: Option<KeptParameters>,
    /// Loss that gives rows with large residuals less weight, for IDIM-LS and DIDIM. Plain least
    /// squares when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robust: Option<RobustLoss>,
    /// Requirements of an applicable result.
    #[serde(default)]
    pub limits: VerdictLimits,
    /// Intended uses: an applicable result is usable for all of these. Monitoring and prediction
    /// unless stated.
    #[serde(default = "Use::default_uses")]
    pub required_uses: Vec<Use>,
    /// Names of the parameters whose values are asked for; those that carry torque unless stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub required_parameters: Option<Vec<String>>,
    /// Tolerances of the configured values of cell and robot.
    #[serde(default)]
    pub tolerances: Tolerances,
    /// Controller of the arm and of the simulated one; methods that simulate the closed loop need
    /// it. CLIE and CLOE keep its gains through all simulations; those that follow an inertia take
    /// the one of IDIM-LS.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub controller: Option<SimulatedController>,
    /// Simulation of the closed loop, and end of the iteration.
    #[serde(default)]
    pub simulation: SimulationOptions,
    /// Options of the search for friction laws.
    #[serde(skip)]
    pub friction_search: FrictionSearch,
    /// Options of the search for the position filter's cut-off frequency.
    #[serde(skip)]
    pub cutoff_search: CutoffSearch,
    /// Limits beyond which a result of the closed loop is not that of the arm.
    #[serde(skip)]
    pub closed_loop_limits: ClosedLoopLimits,
    /// Limits of the judgement of a load.
    #[serde(skip)]
    pub payload_limits: PayloadLimits,
}

impl Options {
    /// With these filters, and whatever else has a usual value at that: every base parameter, least
    /// squares, the usual limits, and nothing that controls the arm.
    pub fn new(position_filter: PositionFilter, decimation_filter: DecimationFilter) -> Self {
        Self {
            position_filter,
            decimation_filter,
            parameters: None,
            keep_nominal: None,
            robust: None,
            limits: VerdictLimits::default(),
            required_uses: Use::default_uses(),
            required_parameters: None,
            tolerances: Tolerances::default(),
            controller: None,
            simulation: SimulationOptions::default(),
            friction_search: FrictionSearch::default(),
            cutoff_search: CutoffSearch::default(),
            closed_loop_limits: ClosedLoopLimits::default(),
            payload_limits: PayloadLimits::default(),
        }
    }

    /// Adds the friction terms that a robot has besides the usual ones to the parameters.
    #[must_use]
    pub fn with_friction(mut self, robot: &Robot) -> Self {
        let fixed: &[String] = match &self.keep_nominal {
            Some(KeptParameters::Named(fixed_part)) => fixed_part,
            _ => &[],
        };
        if let Some(names) = &mut self.parameters {
            let table = robot.parameters();
            for (parameter, name) in table.parameters().iter().zip(table.names()) {
                let is_listed = names.contains(name) || fixed.contains(name);
                if parameter.kind.is_friction_law() && !is_listed {
                    names.push(name.clone());
                }
            }
        }
        self
    }

    /// Returns the base parameters that are identified, and those that keep their nominal values.
    ///
    /// # Errors
    /// Those of [`Selection::new`]; [`IdentificationError::NoNominalValue`],
    /// [`IdentificationError::KeptAndIdentified`].
    pub fn selection(
        &self,
        robot: &Robot,
        base: &BaseParameters,
    ) -> Result<Selection, IdentificationError> {
        let mut selection = Selection::new(robot, base, self.parameters.as_deref())?;
        if let Some(fixed) = &self.keep_nominal {
            fixed.keep_nominal(&mut selection, robot, base)?;
        }
        Ok(selection)
    }

    /// Returns the controller of the simulated arm.
    ///
    /// # Errors
    /// [`IdentificationError::NoController`] if a method needs one and none is configured.
    pub fn controller(&self, method: Method) -> Result<&SimulatedController, IdentificationError> {
        self.controller.as_ref().ok_or(IdentificationError::NoController { method })
    }

    /// Checks that the required uses and parameters exist.
    ///
    /// # Errors
    /// [`IdentificationError::NoUse`] and [`IdentificationError::NotIdentified`].
    pub(crate) fn validate_required(
        &self,
        selection: &Selection,
    ) -> Result<(), IdentificationError> {
        if self.required_uses.is_empty() {
            return Err(IdentificationError::NoUse);
        }
        let Some(required) = &self.required_parameters else { return Ok(()) };
        let unknown = required.iter().find(|name| !selection.names().contains(name));
        let name = match (unknown, required.is_empty()) {
            (Some(name), _) => name.clone(),
            (None, true) => String::new(),
            (None, false) => return Ok(()),
        };
        Err(IdentificationError::NotIdentified { name, available: selection.names().to_vec() })
    }

    /// Checks that a method supports the configured robust loss.
    ///
    /// # Errors
    /// [`IdentificationError::NotRobust`], and the tuning constant of no M-estimate.
    pub fn validate_robust(&self, method: Method) -> Result<(), IdentificationError> {
        match self.robust {
            None => Ok(()),
            Some(loss) if method.has_robust_weights() => {
                loss.validate().map_err(IdentificationError::Regression)
            }
            Some(_) => Err(IdentificationError::NotRobust { method }),
        }
    }
}

/// The Butterworth filter of the positions, forward and backward (paper, section 3.1.1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PositionFilter {
    /// Order of one pass; 4 unless stated.
    #[serde(default = "PositionFilter::default_order")]
    pub order: usize,
    /// Cut-off of one pass \[Hz\], five times the highest dynamics to be modelled or more; there is
    /// no default, because the robot decides it.
    pub cutoff_hz: f64,
}

impl PositionFilter {
    /// 4.
    pub fn default_order() -> usize {
        4
    }

    /// The filter at a sample rate \[Hz\].
    ///
    /// # Errors
    /// [`SignalError::Order`] and [`SignalError::Cutoff`].
    pub fn design(&self, sample_rate_hz: f64) -> Result<SecondOrderSections, SignalError> {
        butterworth_low_pass(self.order, self.cutoff_hz / (0.5 * sample_rate_hz))
    }
}

/// The parallel Chebyshev filter F_p and the decimation factor n_d (paper, equation 6).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DecimationFilter {
    /// Order of one pass.
    #[serde(default = "DecimationFilter::default_order")]
    pub order: usize,
    /// Ripple of one pass in the pass band \[dB\].
    #[serde(default = "DecimationFilter::default_ripple_db")]
    pub ripple_db: f64,
    /// Cut-off, as a share of the Nyquist frequency after decimation.
    #[serde(default = "DecimationFilter::default_cutoff_ratio")]
    pub cutoff_ratio: f64,
    /// One sample of this number becomes a row. With the sample rate it decides the identified
    /// band.
    pub factor: usize,
}

impl DecimationFilter {
    fn default_order() -> usize {
        8
    }

    fn default_ripple_db() -> f64 {
        0.05
    }

    fn default_cutoff_ratio() -> f64 {
        0.8
    }

    /// Cut-off of one pass at a sample rate before decimation, both \[Hz\].
    pub fn cutoff_hz(&self, sample_rate_hz: f64) -> f64 {
        let factor = f64::from(u32::try_from(self.factor).unwrap_or(u32::MAX));
        self.cutoff_ratio * 0.5 * sample_rate_hz / factor
    }

    /// The filter, which depends on the factor only.
    ///
    /// # Errors
    /// [`SignalError::Order`], [`SignalError::Ripple`], [`SignalError::Cutoff`] and
    /// [`SignalError::Factor`].
    pub fn design(&self) -> Result<ParallelDecimation, SignalError> {
        ParallelDecimation::chebyshev1(self.order, self.ripple_db, self.cutoff_ratio, self.factor)
    }
}
