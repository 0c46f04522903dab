//! Options of an identification.

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

/// Options of an identification, the same for every method, as configured in a cell file.
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
    /// Required uses: an applicable result is usable for all of these. The default is monitoring
    /// and prediction.
    #[serde(default = "Use::default_uses")]
    pub required_uses: Vec<Use>,
    /// Names of the parameters whose values are required; by default all that contribute to the
    /// torque.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub required_parameters: Option<Vec<String>>,
    /// Tolerances of the configured values of cell and robot.
    #[serde(default)]
    pub tolerances: Tolerances,
    /// Controller of the real and of the simulated arm; methods that simulate the closed loop need
    /// it. Its gains may follow the inertia: CLIE and CLOE take the inertia of IDIM-LS and keep the
    /// gains through all simulations.
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
    /// Limits beyond which a closed-loop result is not accepted as that of the arm.
    #[serde(skip)]
    pub closed_loop_limits: ClosedLoopLimits,
    /// Limits for judging a payload.
    #[serde(skip)]
    pub payload_limits: PayloadLimits,
}

impl Options {
    /// Creates options with these filters and default values for all others: every base parameter,
    /// least squares, default limits and no controller.
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

    /// Adds the parameters of the robot's additional friction laws to the list of parameters.
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

    /// Returns the base parameters that are identified and those that keep their nominal values.
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
    /// [`IdentificationError::NotRobust`], and an error if the tuning constant is invalid.
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

/// Butterworth filter of the positions, applied forward and backward (paper, section 3.1.1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PositionFilter {
    /// Order of one pass; the default is 4.
    #[serde(default = "PositionFilter::default_order")]
    pub order: usize,
    /// Cut-off of one pass \[Hz\], at least five times the highest frequency of the modelled
    /// dynamics. It has no default, because it depends on the robot.
    pub cutoff_hz: f64,
}

impl PositionFilter {
    /// Returns 4.
    pub fn default_order() -> usize {
        4
    }

    /// Designs the filter for a sample rate \[Hz\].
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

    /// Returns the cut-off of one pass \[Hz\] at a sample rate before decimation \[Hz\].
    pub fn cutoff_hz(&self, sample_rate_hz: f64) -> f64 {
        let factor = f64::from(u32::try_from(self.factor).unwrap_or(u32::MAX));
        self.cutoff_ratio * 0.5 * sample_rate_hz / factor
    }

    /// Designs the filter, which does not depend on the sample rate.
    ///
    /// # Errors
    /// [`SignalError::Order`], [`SignalError::Ripple`], [`SignalError::Cutoff`] and
    /// [`SignalError::Factor`].
    pub fn design(&self) -> Result<ParallelDecimation, SignalError> {
        ParallelDecimation::chebyshev1(self.order, self.ripple_db, self.cutoff_ratio, self.factor)
    }
}
