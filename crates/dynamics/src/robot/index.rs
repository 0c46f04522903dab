//! Numbers of joints and motors, which count from 0 in the program and from 1 for people.

use core::fmt;
use core::ops::{Index, IndexMut};

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

macro_rules! index_type {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, JsonSchema)]
        pub struct $name(usize);

        impl $name {
            /// Creates an index from a position in an array, counted from 0.
            pub const fn new(position: usize) -> Self {
                Self(position)
            }

            /// Creates an index from a number that people use, counted from 1; `None` of 0.
            pub const fn from_number(number: usize) -> Option<Self> {
                match number.checked_sub(1) {
                    Some(position) => Some(Self(position)),
                    None => None,
                }
            }

            /// Returns the position in an array, counted from 0.
            pub const fn position(self) -> usize {
                self.0
            }

            /// Returns the number that people use, counted from 1.
            pub const fn number(self) -> usize {
                self.0 + 1
            }
        }

        /// The number that people use, counted from 1.
        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.number().fmt(f)
            }
        }

        impl Serialize for $name {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                self.number().serialize(serializer)
            }
        }

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let number = usize::deserialize(deserializer)?;
                Self::from_number(number).ok_or_else(|| D::Error::custom("numbers begin at 1"))
            }
        }

        impl<T> Index<$name> for [T] {
            type Output = T;

            fn index(&self, index: $name) -> &T {
                &self[index.0]
            }
        }

        impl<T> Index<$name> for Vec<T> {
            type Output = T;

            fn index(&self, index: $name) -> &T {
                &self[index.0]
            }
        }

        impl<T> IndexMut<$name> for [T] {
            fn index_mut(&mut self, index: $name) -> &mut T {
                &mut self[index.0]
            }
        }

        impl<T> IndexMut<$name> for Vec<T> {
            fn index_mut(&mut self, index: $name) -> &mut T {
                &mut self[index.0]
            }
        }
    };
}

index_type! {
    /// A joint of an arm: 0 is the one at the base. It is shown and stored from 1.
    ///
    /// ```
    /// use didim_dynamics::robot::JointIndex;
    ///
    /// let torque_nm = [12.0, 7.5];
    /// let elbow = JointIndex::new(1);
    /// assert_eq!(torque_nm[elbow], 7.5);
    /// assert_eq!(elbow.to_string(), "2");
    /// ```
    JointIndex
}

index_type! {
    /// A motor of an arm, in the order of the bus. It is shown and stored from 1.
    MotorIndex
}
