//! A tape as statements of a language of the C family.

use std::collections::BTreeMap;

use super::tape::{Operation, Tape};

/// Length of an expression above which its parts become variables.
const MAX_EXPRESSION_LENGTH: usize = 96;

/// Differences between C and Rust in writing the same computation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Language {
    C,
    Rust,
}

impl Language {
    fn named_statement(self, name: &str, value: &str) -> String {
        match self {
            Self::C => format!("const double {name} = {value};"),
            Self::Rust => format!("let {name} = {value};"),
        }
    }

    /// Returns the statement for both functions, which share their work.
    fn sine_and_cosine(self, prefix: &str, [sine, cosine]: [&str; 2], angle: &str) -> String {
        match self {
            Self::C => {
                format!("double {sine}, {cosine}; {prefix}sin_cos({angle}, &{sine}, &{cosine});")
            }
            Self::Rust => format!("let ({sine}, {cosine}) = sin_cos({angle});"),
        }
    }

    fn library_call(self, prefix: &str, function: &str, of: &str) -> String {
        match self {
            Self::C => format!("{prefix}{function}({of})"),
            Self::Rust => format!("{function}({of})"),
        }
    }
}

/// Precedence of the outermost operation of an expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Precedence {
    Sum,
    Product,
    Sign,
    Complete,
}

#[derive(Clone, Debug)]
struct Expression {
    text: String,
    binding: Precedence,
}

impl Expression {
    fn new(text: String) -> Self {
        Self { text, binding: Precedence::Complete }
    }

    /// Adds brackets if the precedence is lower.
    fn bracketed(&self, least: Precedence) -> String {
        if self.binding < least { format!("({})", self.text) } else { self.text.clone() }
    }
}

/// Returns the statements that compute these nodes, and for each node its expression. `input` names
/// an input; `prefix` begins the names of functions in C. `None` if the tape has a function that
/// cannot be written.
pub(super) fn statements(
    tape: &Tape,
    wanted: &[usize],
    language: Language,
    prefix: &str,
    input: impl Fn(usize) -> String,
) -> Option<(Vec<String>, Vec<String>)> {
    let uses = use_counts(tape, wanted);
    let mut written: BTreeMap<usize, Expression> = BTreeMap::new();
    let (mut lines, mut names) = (Vec::new(), 0);
    for (node, operation) in tape.nodes.iter().enumerate().filter(|(node, _)| uses[*node] > 0) {
        let text = |of: usize, least: Precedence| written[&of].bracketed(least);
        let function = |name: &str, of: usize| {
            Expression::new(language.library_call(prefix, name, &text(of, Precedence::Sum)))
        };
        let expression = match *operation {
            Operation::Constant(value) => {
                let binding = if value < 0.0 { Precedence::Sign } else { Precedence::Complete };
                Expression { text: format!("{value:?}"), binding }
            }
            Operation::Input(number) => Expression::new(input(number)),
            Operation::Add(a, b) => Expression {
                text: format!("{} + {}", text(a, Precedence::Sum), text(b, Precedence::Product)),
                binding: Precedence::Sum,
            },
            Operation::Subtract(a, b) => Expression {
                text: format!("{} - {}", text(a, Precedence::Sum), text(b, Precedence::Product)),
                binding: Precedence::Sum,
            },
            Operation::Multiply(a, b) => Expression {
                text: format!("{} * {}", text(a, Precedence::Product), text(b, Precedence::Sign)),
                binding: Precedence::Product,
            },
            Operation::Divide(a, b) => Expression {
                text: format!("{} / {}", text(a, Precedence::Product), text(b, Precedence::Sign)),
                binding: Precedence::Product,
            },
            Operation::Negate(a) => Expression {
                text: format!("-{}", text(a, Precedence::Complete)),
                binding: Precedence::Sign,
            },
            Operation::Sine(a) | Operation::Cosine(a) => {
                let [sine, cosine] = ["s", "c"].map(|name| format!("{name}{a}"));
                let statement =
                    language.sine_and_cosine(prefix, [&sine, &cosine], &text(a, Precedence::Sum));
                if !lines.contains(&statement) {
                    lines.push(statement);
                }
                let is_sine = matches!(operation, Operation::Sine(_));
                Expression::new(if is_sine { sine } else { cosine })
            }
            Operation::Tanh(a) => function("tanh", a),
            Operation::Sign(a) => function("sign", a),
            Operation::DeadBandSign(a, threshold) => {
                let arguments = format!("{}, {threshold:?}", text(a, Precedence::Sum));
                Expression::new(language.library_call(prefix, "dead_band_sign", &arguments))
            }
            Operation::Opaque(_) => return None,
        };
        let is_shared = uses[node] > 1 && expression.binding < Precedence::Complete;
        let is_call = matches!(
            operation,
            Operation::Tanh(_) | Operation::Sign(_) | Operation::DeadBandSign(..)
        );
        let is_constant = matches!(operation, Operation::Constant(_));
        if !is_constant && (is_shared || is_call || expression.text.len() > MAX_EXPRESSION_LENGTH) {
            let name = format!("t{names}");
            names += 1;
            lines.push(language.named_statement(&name, &expression.text));
            written.insert(node, Expression::new(name));
        } else {
            written.insert(node, expression);
        }
    }
    let results = wanted.iter().map(|node| written[node].text.clone()).collect();
    Some((lines, results))
}

/// Counts how often the wanted nodes need each node.
fn use_counts(tape: &Tape, wanted: &[usize]) -> Vec<usize> {
    let mut uses = vec![0; tape.nodes.len()];
    for &node in wanted {
        uses[node] += 1;
    }
    for node in (0..tape.nodes.len()).rev() {
        if uses[node] > 0 {
            for operand in tape.nodes[node].operands() {
                uses[operand] += 1;
            }
        }
    }
    uses
}
