//! A scalar that records its computations: each operation becomes a node, constants are folded, and
//! no computation is recorded twice.

use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};
use std::cell::RefCell;
use std::collections::HashMap;

use didim_dynamics::numeric::Scalar;

/// Operation of a node on earlier nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Operation {
    Constant(f64),
    /// Number of an input.
    Input(usize),
    Add(usize, usize),
    Subtract(usize, usize),
    Multiply(usize, usize),
    Divide(usize, usize),
    Negate(usize),
    Sine(usize),
    Cosine(usize),
    Tanh(usize),
    Sign(usize),
    DeadBandSign(usize, f64),
    /// A function that cannot be written down.
    Opaque(usize),
}

/// Operations in the order in which they can be computed.
#[derive(Clone, Debug, Default)]
pub(super) struct Tape {
    pub(super) nodes: Vec<Operation>,
    node_of_operation: HashMap<(u8, usize, usize, u64), usize>,
}

thread_local! {
    /// A scalar is `Copy`, so it cannot own its tape.
    static TAPE: RefCell<Tape> = RefCell::new(Tape::default());
}

/// A node of the present tape.
#[derive(Clone, Copy, Debug)]
pub(super) struct Traced(pub(super) usize);

/// Records a computation: returns its tape and the nodes of its results.
pub(super) fn trace(work: impl FnOnce() -> Vec<Traced>) -> (Tape, Vec<usize>) {
    TAPE.replace(Tape::default());
    let results = work().into_iter().map(|Traced(node)| node).collect();
    (TAPE.take(), results)
}

impl Traced {
    /// Creates the input of a number.
    pub(super) fn input(number: usize) -> Self {
        write(Operation::Input(number))
    }
}

fn write(operation: Operation) -> Traced {
    TAPE.with_borrow_mut(|tape| {
        let next = tape.nodes.len();
        let node = *tape.node_of_operation.entry(operation.deduplication_key()).or_insert(next);
        if node == next {
            tape.nodes.push(operation);
        }
        Traced(node)
    })
}

fn operation_of_node(Traced(node): Traced) -> Operation {
    TAPE.with_borrow(|tape| tape.nodes[node])
}

impl Operation {
    /// Returns a key that is equal for the same operation on the same nodes.
    fn deduplication_key(self) -> (u8, usize, usize, u64) {
        match self {
            Self::Constant(value) => (0, 0, 0, value.to_bits()),
            Self::Input(number) => (1, number, 0, 0),
            // The key does not depend on the order of the operands.
            Self::Add(a, b) => (2, a.min(b), a.max(b), 0),
            Self::Subtract(a, b) => (3, a, b, 0),
            Self::Multiply(a, b) => (4, a.min(b), a.max(b), 0),
            Self::Divide(a, b) => (5, a, b, 0),
            Self::Negate(a) => (6, a, 0, 0),
            Self::Sine(a) => (7, a, 0, 0),
            Self::Cosine(a) => (8, a, 0, 0),
            Self::Tanh(a) => (9, a, 0, 0),
            Self::Sign(a) => (10, a, 0, 0),
            Self::DeadBandSign(a, threshold) => (11, a, 0, threshold.to_bits()),
            Self::Opaque(a) => (12, a, 0, 0),
        }
    }

    /// Returns the nodes that it depends on.
    pub(super) fn operands(self) -> impl Iterator<Item = usize> {
        let (first, second) = match self {
            Self::Constant(_) | Self::Input(_) => (None, None),
            Self::Add(a, b) | Self::Subtract(a, b) | Self::Multiply(a, b) | Self::Divide(a, b) => {
                (Some(a), Some(b))
            }
            Self::Negate(a)
            | Self::Sine(a)
            | Self::Cosine(a)
            | Self::Tanh(a)
            | Self::Sign(a)
            | Self::DeadBandSign(a, _)
            | Self::Opaque(a) => (Some(a), None),
        };
        first.into_iter().chain(second)
    }
}

impl Add for Traced {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        match (operation_of_node(self), operation_of_node(other)) {
            (Operation::Constant(a), Operation::Constant(b)) => Self::constant(a + b),
            (Operation::Constant(0.0), _) => other,
            (_, Operation::Constant(0.0)) => self,
            (_, Operation::Negate(b)) => self - Self(b),
            (Operation::Negate(a), _) => other - Self(a),
            _ => write(Operation::Add(self.0, other.0)),
        }
    }
}

impl Sub for Traced {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        match (operation_of_node(self), operation_of_node(other)) {
            (Operation::Constant(a), Operation::Constant(b)) => Self::constant(a - b),
            (Operation::Constant(0.0), _) => -other,
            (_, Operation::Constant(0.0)) => self,
            (_, Operation::Negate(b)) => self + Self(b),
            _ if self.0 == other.0 => Self::zero(),
            _ => write(Operation::Subtract(self.0, other.0)),
        }
    }
}

impl Mul for Traced {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        match (operation_of_node(self), operation_of_node(other)) {
            (Operation::Constant(a), Operation::Constant(b)) => Self::constant(a * b),
            (Operation::Constant(0.0), _) | (_, Operation::Constant(0.0)) => Self::zero(),
            (Operation::Constant(1.0), _) => other,
            (_, Operation::Constant(1.0)) => self,
            (Operation::Constant(-1.0), _) => -other,
            (_, Operation::Constant(-1.0)) => -self,
            (Operation::Negate(a), Operation::Negate(b)) => Self(a) * Self(b),
            (Operation::Negate(a), Operation::Constant(b))
            | (Operation::Constant(b), Operation::Negate(a)) => Self(a) * Self::constant(-b),
            (Operation::Negate(a), _) => -(Self(a) * other),
            (_, Operation::Negate(b)) => -(self * Self(b)),
            // Constant factors are multiplied first.
            (Operation::Multiply(a, b), Operation::Constant(c))
            | (Operation::Constant(c), Operation::Multiply(a, b))
                if matches!(operation_of_node(Self(a)), Operation::Constant(_)) =>
            {
                Self(a) * Self::constant(c) * Self(b)
            }
            // Constants come first.
            (_, Operation::Constant(_)) => write(Operation::Multiply(other.0, self.0)),
            _ => write(Operation::Multiply(self.0, other.0)),
        }
    }
}

impl Div for Traced {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        match (operation_of_node(self), operation_of_node(other)) {
            (Operation::Constant(a), Operation::Constant(b)) => Self::constant(a / b),
            (_, Operation::Constant(1.0)) => self,
            _ => write(Operation::Divide(self.0, other.0)),
        }
    }
}

impl Neg for Traced {
    type Output = Self;

    fn neg(self) -> Self {
        match operation_of_node(self) {
            Operation::Constant(value) => Self::constant(-value),
            Operation::Negate(a) => Self(a),
            Operation::Subtract(a, b) => Self(b) - Self(a),
            _ => write(Operation::Negate(self.0)),
        }
    }
}

impl AddAssign for Traced {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Traced {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl MulAssign for Traced {
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}

impl Scalar for Traced {
    fn constant(value: f64) -> Self {
        // −0 becomes 0, which is the same in every sum.
        write(Operation::Constant(value + 0.0))
    }

    fn sin_cos(self) -> (Self, Self) {
        match operation_of_node(self) {
            Operation::Constant(value) => {
                let (sin, cos) = Scalar::sin_cos(value);
                (Self::constant(sin), Self::constant(cos))
            }
            _ => (write(Operation::Sine(self.0)), write(Operation::Cosine(self.0))),
        }
    }

    fn tanh(self) -> Self {
        match operation_of_node(self) {
            Operation::Constant(value) => Self::constant(Scalar::tanh(value)),
            _ => write(Operation::Tanh(self.0)),
        }
    }

    fn is_zero(self) -> bool {
        operation_of_node(self) == Operation::Constant(0.0)
    }

    fn sign(self) -> Self {
        match operation_of_node(self) {
            Operation::Constant(value) => Self::constant(Scalar::sign(value)),
            _ => write(Operation::Sign(self.0)),
        }
    }

    fn dead_band_sign(self, threshold: f64) -> Self {
        match operation_of_node(self) {
            Operation::Constant(value) => Self::constant(Scalar::dead_band_sign(value, threshold)),
            _ => write(Operation::DeadBandSign(self.0, threshold)),
        }
    }

    fn apply(self, function: impl Fn(f64) -> [f64; 2]) -> Self {
        match operation_of_node(self) {
            Operation::Constant(value) => Self::constant(function(value)[0]),
            _ => write(Operation::Opaque(self.0)),
        }
    }

    fn all_positive(self) -> bool {
        matches!(operation_of_node(self), Operation::Constant(value) if value > 0.0)
    }
}
