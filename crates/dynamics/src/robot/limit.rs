//! A limit in a robot file that may be unknown.

use core::fmt;
use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, Error, Visitor};

/// The word for an unknown limit.
const UNKNOWN_LIMIT: &str = "unknown";

/// A number, or the word for an unknown one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum RawLimit {
    Number(f64),
    Unknown,
}

impl JsonSchema for RawLimit {
    fn schema_name() -> Cow<'static, str> {
        "RawLimit".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "anyOf": [{ "type": "number" }, { "const": UNKNOWN_LIMIT }] })
    }
}

impl<'de> Deserialize<'de> for RawLimit {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(OfLimit)
    }
}

struct OfLimit;

impl Visitor<'_> for OfLimit {
    type Value = RawLimit;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a number, or \"{UNKNOWN_LIMIT}\" where no source gives it")
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<RawLimit, E> {
        Ok(RawLimit::Number(value))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<RawLimit, E> {
        #[expect(clippy::cast_precision_loss, reason = "no limit is beyond 2^52")]
        Ok(RawLimit::Number(value as f64))
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<RawLimit, E> {
        match word {
            UNKNOWN_LIMIT => Ok(RawLimit::Unknown),
            other => Err(E::invalid_value(serde::de::Unexpected::Str(other), &self)),
        }
    }
}
