//! Content and method of the identification.

use super::super::reference::Kind::{Form, Integer, Number, Other, Switch, Table, Texts, Word};
use super::super::reference::Presence::{Default, Optional, Required};
use super::super::reference::{Section, key};

const METHODS: &[&str] = &["idim-ls", "idim-iv", "clie", "cloe", "didim"];
const USES: &str = "What results are for, and so what makes one applicable: `\"monitoring\"`, of \
    this arm over the years; `\"prediction\"`, of the torque of any motion; \
    `\"contact-detection\"`; `\"physical-values\"`, for comparison with a data sheet; \
    `\"rigid-body\"`, a mass matrix that can be inverted anywhere.";

pub(super) const SECTIONS: &[Section] = &[
    Section {
        heading: "[identification]",
        path: "identification",
        about: "Identification: parameters, method and filters.",
        keys: &[
            key(
                "method",
                Word(METHODS),
                "",
                Required,
                "The method. All but `\"idim-ls\"` simulate the closed loop and need \
                `[controller]`.",
            ),
            key(
                "sign",
                Other("table"),
                "",
                Optional("that of the robot file"),
                "The law for the sign in Coulomb friction, for all joints: `sign` under \
                `[friction]` of a robot file.",
            ),
            key(
                "friction",
                Word(&["auto"]),
                "",
                Optional("those of the robot file"),
                "`\"auto\"`: the data choose the friction laws of the joints. For `didim identify` \
                and `didim compare`.",
            ),
            key("position_filter", Table, "", Required, "Filter of the positions."),
            key(
                "decimation_filter",
                Table,
                "",
                Required,
                "Filter and decimation of both sides of the equation.",
            ),
            key(
                "parameters",
                Texts,
                "",
                Optional("every base parameter"),
                "Names of the parameters to identify (didim-parameters(7)). Others are 0, \
                    unless they keep their nominal values.",
            ),
            key(
                "keep_nominal",
                Other("`\"all\"`, or a list of texts"),
                "",
                Optional("none"),
                "Parameters that are not identified and keep the values of `[nominal]` in the \
                    robot file.",
            ),
            key(
                "robust",
                Table,
                "",
                Optional("least squares"),
                "Loss that gives rows with large residuals less weight; with `\"idim-ls\"` and \
                    `\"didim\"`.",
            ),
            key(
                "limits",
                Table,
                "",
                Optional("as its defaults say"),
                "Limits that a result has to satisfy to be applicable.",
            ),
            key("required_uses", Texts, "", Default("[\"monitoring\", \"prediction\"]"), USES),
            key(
                "required_parameters",
                Texts,
                "",
                Optional("those that carry torque"),
                "The parameters whose values are required, with `\"physical-values\"`.",
            ),
            key(
                "tolerances",
                Table,
                "",
                Optional("as its defaults say"),
                "Tolerances of the values in the cell and robot file.",
            ),
            key(
                "simulation",
                Table,
                "",
                Optional("as its defaults say"),
                "How the closed loop is simulated, and when the iteration ends. Needs \
                `[controller]`.",
            ),
        ],
        example: "[identification]\nmethod = \"idim-ls\"\nposition_filter = { cutoff_hz = 200.0 \
            }\ndecimation_filter = { factor = 125 }\nparameters = [\"zz1r\", \"fv1\", \
            \"fc1\"]\nkeep_nominal = [\"zz5r\"]\nsign = { model = \"dead-band\", threshold_rad_s = \
            0.02 }",
    },
    Section {
        heading: "identification.position_filter",
        path: "identification.position_filter",
        about: "A Butterworth filter, forward and backward, before positions are differentiated.",
        keys: &[
            key("order", Integer, "", Default("4"), "Order of one pass."),
            key(
                "cutoff_hz",
                Other("number, or `\"auto\"`"),
                "Hz",
                Required,
                "Cut-off of one pass: five times the highest dynamics to be modelled, or more. \
                 `\"auto\"`: the data choose it, for `didim identify` and `didim compare`.",
            ),
        ],
        example: "[identification]\nposition_filter = { order = 4, cutoff_hz = \"auto\" }",
    },
    Section {
        heading: "identification.decimation_filter",
        path: "identification.decimation_filter",
        about: "A Chebyshev filter, forward and backward, on torques and regressor alike; then one \
            sample in `factor` becomes a row.",
        keys: &[
            key("order", Integer, "", Default("8"), "Order of one pass."),
            key("ripple_db", Number, "dB", Default("0.05"), "Ripple of one pass in the pass band."),
            key(
                "cutoff_ratio",
                Number,
                "",
                Default("0.8"),
                "Cut-off, as a share of the Nyquist frequency after decimation.",
            ),
            key(
                "factor",
                Integer,
                "",
                Required,
                "One sample of this number becomes a row. With the sample rate it decides the \
                    identified band.",
            ),
        ],
        example: "[identification]\ndecimation_filter = { factor = 125, order = 8, ripple_db = \
            0.05, cutoff_ratio = 0.8 }",
    },
    Section {
        heading: "identification.robust: huber",
        path: "identification.robust",
        about: "A residual counts fully up to the tuning constant; beyond it the weight falls, \
            so that its influence stays constant.",
        keys: &[
            key("kind", Form("huber"), "", Required, "The form."),
            key(
                "tuning",
                Number,
                "σ",
                Default("1.345"),
                "The tuning constant, in standard deviations of the residuals.",
            ),
        ],
        example: "[identification]\nrobust = { kind = \"huber\", tuning = 1.345 }",
    },
    Section {
        heading: "identification.robust: bisquare",
        path: "identification.robust",
        about: "The weight falls with the residual, to zero at the tuning constant.",
        keys: &[
            key("kind", Form("bisquare"), "", Required, "The form."),
            key(
                "tuning",
                Number,
                "σ",
                Default("4.685"),
                "The tuning constant, in standard deviations of the residuals.",
            ),
        ],
        example: "[identification]\nrobust = { kind = \"bisquare\" }",
    },
    Section {
        heading: "[identification.limits]",
        path: "identification.limits",
        about: "Limits that a result has to satisfy to be applicable. Each is greater than 0; \
            shares are at most 1, so that 5 % is 0.05.",
        keys: &[
            key(
                "rows_per_parameter",
                Number,
                "",
                Default("8.0"),
                "Fewest independent rows for each parameter: the rows times \
                `decimation_filter.cutoff_ratio`.",
            ),
            key(
                "condition_number",
                Number,
                "",
                Default("10000.0"),
                "Largest condition number of the weighted, decimated observation matrix.",
            ),
            key(
                "prediction_deviation",
                Number,
                "share",
                Default("0.1"),
                "Largest torque uncertainty of a joint along the window's own motion, from the \
                    parameters, relative to that torque.",
            ),
            key(
                "relative_error",
                Number,
                "share",
                Default("0.1"),
                "Largest relative error ‖y − Xθ‖/‖y‖ over all joints.",
            ),
            key(
                "relative_error_per_joint",
                Number,
                "share",
                Default("0.25"),
                "Largest relative error of a single joint.",
            ),
            key(
                "negative_deviations",
                Number,
                "σ",
                Default("3.0"),
                "Standard deviations below zero from which a friction coefficient or a drive \
                    inertia is impossible.",
            ),
            key(
                "error_elsewhere",
                Number,
                "share",
                Default("0.15"),
                "Largest torque uncertainty outside the recorded motion, relative to the torque.",
            ),
            key(
                "held_out_error",
                Number,
                "share",
                Default("0.15"),
                "Largest cross-validation error: on held-out parts of the motion, relative to \
                    their torque.",
            ),
            key(
                "parameter_uncertainty",
                Number,
                "share",
                Default("0.1"),
                "Largest combined uncertainty of a parameter whose value is required, relative \
                    to it.",
            ),
            key(
                "model_shift_deviations",
                Number,
                "σ",
                Default("4.0"),
                "With CLOE: largest distance between the parameters from positions and those \
                    from torques.",
            ),
            key(
                "model_probability",
                Number,
                "share",
                Default("1e-4"),
                "A note is given if white residuals would have this correlation with less than \
                    this probability.",
            ),
            key(
                "controller_error",
                Number,
                "share",
                Default("0.001"),
                "Largest difference between the command of the described controller and the \
                    recorded torque, relative to it and without noise.",
            ),
            key(
                "position_filter_deviations",
                Number,
                "σ",
                Default("0.5"),
                "A note is given if position filter and position noise shift a parameter by \
                    more than this.",
            ),
        ],
        example: "[identification.limits]\nrelative_error = 0.08\nrows_per_parameter = 10.0",
    },
    Section {
        heading: "[identification.tolerances]",
        path: "identification.tolerances",
        about: "Tolerances of the values in the cell and robot file: one standard deviation of \
            each, for all joints, greater than 0. They are part of every combined uncertainty.",
        keys: &[
            key(
                "torque_gain",
                Number,
                "share",
                Default("0.01"),
                "Relative error of a joint's torque gain, and of a factor common to all.",
            ),
            key(
                "torque_delay_s",
                Number,
                "s",
                Default("0.0002"),
                "Error of the instant at which a joint's torque is valid.",
            ),
            key("zero_deg", Number, "°", Default("0.5"), "Error of a revolute joint's zero."),
            key(
                "twist_deg",
                Number,
                "°",
                Default("0.1"),
                "Error of the angle between neighbouring axes.",
            ),
            key(
                "length_m",
                Number,
                "m",
                Default("0.001"),
                "Error of the distances between neighbour axes, and of a prismatic joint's zero.",
            ),
            key(
                "known_torque",
                Number,
                "share",
                Default("0.02"),
                "Relative error of a known torque, such as that of a spring, and of its slope \
                    over the range of the joint.",
            ),
        ],
        example: "[identification.tolerances]\ntorque_gain = 0.02\nzero_deg = 0.1",
    },
    Section {
        heading: "[identification.simulation]",
        path: "identification.simulation",
        about: "Simulation of the closed loop, for every method that needs it.",
        keys: &[
            key(
                "decimated",
                Switch,
                "",
                Default("true"),
                "True if both sides of the equation pass the decimation filter. If false, every \
                    counted sample is a row.",
            ),
            key(
                "reference",
                Word(&["cubic", "linear", "hold"]),
                "",
                Default("\"cubic\""),
                "Interpolation of the drive between two targets: a cubic, a straight line, or \
                    the target itself until the next.",
            ),
            key(
                "integrator",
                Word(&["ode3", "rk4"]),
                "",
                Default("\"ode3\""),
                "Integration method of the simulation: Bogacki and Shampine's third order, or \
                    the classical fourth.",
            ),
            key(
                "substeps",
                Integer,
                "",
                Default("1"),
                "Integration steps in one period of the controller.",
            ),
            key(
                "start",
                Word(&["unit-drive-inertias", "nominal", "idim-ls"]),
                "",
                Default("\"idim-ls\""),
                "The parameters of the first simulation: every drive inertia 1 kg·m² and all else \
                 0; the nominal parameters of the robot file; the result of IDIM-LS.",
            ),
            key(
                "convergence",
                Table,
                "",
                Optional("as its defaults say"),
                "When the iteration ends.",
            ),
            key(
                "didim_steps",
                Integer,
                "",
                Default("0"),
                "Iterations of DIDIM before the first sensitivities of CLIE and CLOE, for starts \
                 far away; less than `convergence.max_simulations`.",
            ),
            key(
                "sensitivities",
                Word(&["exact", "differences"]),
                "",
                Default("\"exact\""),
                "Source of the sensitivities of CLIE and CLOE: the variational equation of the \
                    loop, or one-sided differences.",
            ),
            key(
                "optimiser",
                Word(&["levenberg-marquardt", "gauss-newton"]),
                "",
                Default("\"levenberg-marquardt\""),
                "Optimiser of CLIE and CLOE.",
            ),
            key(
                "bodies",
                Other("`\"nominal\"`, or a table"),
                "",
                Optional("any parameters"),
                "Restricts the linear steps of DIDIM, CLIE and CLOE to physically consistent \
                parameters. `\"nominal\"`: near those of the robot file; `{ total_mass_kg = 27.0 \
                }`: of this mass of all moving links [kg].",
            ),
        ],
        example: "[identification.simulation]\nstart = \"unit-drive-inertias\"\nsubsteps = \
            2\nbodies = { total_mass_kg = 27.0 }",
    },
    Section {
        heading: "identification.simulation.convergence",
        path: "identification.simulation.convergence",
        about: "The iteration ends when a step changes the estimates by no more than this.",
        keys: &[
            key(
                "relative_error_change",
                Number,
                "share",
                Default("0.01"),
                "Largest change of the error ‖y − Xθ‖ from one step to the next, relative to \
                    it, or to 0.1 % of ‖y‖ if the error is smaller.",
            ),
            key(
                "parameter_change",
                Number,
                "σ",
                Default("0.2"),
                "Largest difference between a parameter and the one that was simulated.",
            ),
            key(
                "max_simulations",
                Integer,
                "",
                Default("30"),
                "Simulations after which there is no result, failed ones included; 2 at least.",
            ),
        ],
        example: "[identification.simulation]\nconvergence = { relative_error_change = 0.01, \
            parameter_change = 0.2, max_simulations = 30 }",
    },
];
