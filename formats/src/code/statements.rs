//! A tape as statements of a language of the C family.

use std::collections::BTreeMap;

use super::tape::{Operation, Tape};

/// A longer expression gets a name for its parts.
const LONGEST: usize = 96;

/// Where C and Rust write the same computation differently.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Language {
    C,
    Rust,
}

impl Language {
    fn named(self, name: &str, value: &str) -> String {
        match self {
            Self::C => format!("const double {name} = {value};"),
            Self::Rust => format!("let {name} = {value};"),
        }
    }

    /// Both at once: they share their work.
    fn sine_and_cosine(self, prefix: &str, [sine, cosine]: [&str; 2], angle: &str) -> String {
        match self {
            Self::C => {
                format!("double {sine}, {cosine}; {prefix}sin_cos({angle}, &{sine}, &{cosine});")
            }
            Self::Rust => format!("let ({sine}, {cosine}) = sin_cos({angle});"),
        }
    }

    fn call(self, prefix: &str, function: &str, of: &str) -> String {
        match self {
            Self::C => format!("{prefix}{function}({of})"),
            Self::Rust => format!("{function}({of})"),
        }
    }
}

/// How tightly the outermost operation of an expression binds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Binding {
    Sum,
    Product,
    Sign,
    Whole,
}

#[derive(Clone, Debug)]
struct Expression {
    text: String,
    binding: Binding,
}

impl Expression {
    fn whole(text: String) -> Self {
        Self { text, binding: Binding::Whole }
    }

    /// With brackets where it binds less than that.
    fn within(&self, least: Binding) -> String {
        if self.binding < least { format!("({})", self.text) } else { self.text.clone() }
    }
}

/// The statements that compute these nodes, and for each node the expression that it is then. `input` names an input;
/// `prefix` begins the names of functions in C. None when a function of it cannot be written.
pub(super) fn statements(
    tape: &Tape,
    wanted: &[usize],
    language: Language,
    prefix: &str,
    input: impl Fn(usize) -> String,
) -> Option<(Vec<String>, Vec<String>)> {
    let uses = uses(tape, wanted);
    let mut written: BTreeMap<usize, Expression> = BTreeMap::new();
    let (mut lines, mut names) = (Vec::new(), 0);
    for (node, operation) in tape.nodes.iter().enumerate().filter(|(node, _)| uses[*node] > 0) {
        let text = |of: usize, least: Binding| written[&of].within(least);
        let function = |name: &str, of: usize| {
            Expression::whole(language.call(prefix, name, &text(of, Binding::Sum)))
        };
        let expression = match *operation {
            Operation::Constant(value) => {
                let binding = if value < 0.0 { Binding::Sign } else { Binding::Whole };
                Expression { text: format!("{value:?}"), binding }
            }
            Operation::Input(number) => Expression::whole(input(number)),
            Operation::Add(a, b) => Expression {
                text: format!("{} + {}", text(a, Binding::Sum), text(b, Binding::Product)),
                binding: Binding::Sum,
            },
            Operation::Subtract(a, b) => Expression {
                text: format!("{} - {}", text(a, Binding::Sum), text(b, Binding::Product)),
                binding: Binding::Sum,
            },
            Operation::Multiply(a, b) => Expression {
                text: format!("{} * {}", text(a, Binding::Product), text(b, Binding::Sign)),
                binding: Binding::Product,
            },
            Operation::Divide(a, b) => Expression {
                text: format!("{} / {}", text(a, Binding::Product), text(b, Binding::Sign)),
                binding: Binding::Product,
            },
            Operation::Negate(a) => {
                Expression { text: format!("-{}", text(a, Binding::Whole)), binding: Binding::Sign }
            }
            Operation::Sine(a) | Operation::Cosine(a) => {
                let [sine, cosine] = ["s", "c"].map(|name| format!("{name}{a}"));
                let statement =
                    language.sine_and_cosine(prefix, [&sine, &cosine], &text(a, Binding::Sum));
                if !lines.contains(&statement) {
                    lines.push(statement);
                }
                let is_sine = matches!(operation, Operation::Sine(_));
                Expression::whole(if is_sine { sine } else { cosine })
            }
            Operation::Tanh(a) => function("tanh", a),
            Operation::Sign(a) => function("sign", a),
            Operation::DeadBandSign(a, threshold) => {
                let arguments = format!("{}, {threshold:?}", text(a, Binding::Sum));
                Expression::whole(language.call(prefix, "dead_band_sign", &arguments))
            }
            Operation::Opaque(_) => return None,
        };
        let is_shared = uses[node] > 1 && expression.binding < Binding::Whole;
        let is_call = matches!(
            operation,
            Operation::Tanh(_) | Operation::Sign(_) | Operation::DeadBandSign(..)
        );
        let is_constant = matches!(operation, Operation::Constant(_));
        if !is_constant && (is_shared || is_call || expression.text.len() > LONGEST) {
            let name = format!("t{names}");
            names += 1;
            lines.push(language.named(&name, &expression.text));
            written.insert(node, Expression::whole(name));
        } else {
            written.insert(node, expression);
        }
    }
    let results = wanted.iter().map(|node| written[node].text.clone()).collect();
    Some((lines, results))
}

/// How often each node is needed for those that are wanted.
fn uses(tape: &Tape, wanted: &[usize]) -> Vec<usize> {
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
