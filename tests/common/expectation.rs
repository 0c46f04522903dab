//! What a file of `sim-fixtures/faults` says that a test has to find.
#![allow(dead_code, reason = "each test program uses a part of it")]

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::path::Path;

/// Values of `[tested.expected]` of one file. Each of them has to be asked for, or the test fails.
pub(crate) struct Expectation {
    values: toml::Table,
    unread: RefCell<BTreeSet<String>>,
}

impl Expectation {
    /// Reads the file of a fault.
    pub(crate) fn of(fault: &str) -> Self {
        let mut above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
        let folder = above.find_map(|folder| {
            let folder = folder.join("sim-fixtures/faults");
            folder.is_dir().then_some(folder)
        });
        let text = std::fs::read_to_string(folder.unwrap().join(format!("{fault}.toml"))).unwrap();
        let file: toml::Table = toml::from_str(&text).unwrap();
        let values = file["tested"]["expected"].as_table().unwrap().clone();
        let unread = RefCell::new(values.keys().cloned().collect());
        Self { values, unread }
    }

    /// A value of the file.
    pub(crate) fn get<T: serde::de::DeserializeOwned>(&self, key: &str) -> T {
        self.unread.borrow_mut().remove(key);
        self.values[key].clone().try_into().unwrap()
    }

    /// Asserts that a value is the one of the file.
    pub(crate) fn assert_eq<T>(&self, key: &str, value: &T)
    where
        T: serde::de::DeserializeOwned + PartialEq + core::fmt::Debug,
    {
        assert_eq!(*value, self.get::<T>(key), "{key}");
    }

    /// Asserts that a text has the words of `says`, with the values of its `{placeholders}`.
    pub(crate) fn assert_said(&self, text: &str, placeholders: &[(&str, &dyn ToString)]) {
        let words: Vec<String> = self.get("says");
        assert!(!words.is_empty());
        for mut word in words {
            for (name, value) in placeholders {
                word = word.replace(&format!("{{{name}}}"), &value.to_string());
            }
            assert!(text.contains(&word), "`{word}` is not in {text}");
        }
    }
}

impl Drop for Expectation {
    fn drop(&mut self) {
        let unread = self.unread.borrow();
        assert!(std::thread::panicking() || unread.is_empty(), "not asserted: {unread:?}");
    }
}
