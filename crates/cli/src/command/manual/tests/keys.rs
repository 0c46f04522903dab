//! Tests of the key tables against the types that read the files: the keys that serde knows and
//! requires, and its defaults.

use std::collections::{BTreeMap, BTreeSet};

use didim::cell::CellFile;
use didim_dynamics::robot::Robot;
use didim_identification::identification::Use;
use toml::{Table, Value};

use super::super::cell::CELL;
use super::super::reference::{Key, Kind, Presence, Reference, Section};
use super::super::robot::ROBOT;

/// Text around the example of a section, which makes it a complete file.
const AROUND_CELL: &str = r#"
name = "test"
robot = "robot.toml"
[bus]
source = "can:can0"
[bus.layout]
dbc = "drives.dbc"
axes = 1
rate_hz = 500.0
position = { signal = "M.P", valid = "instant" }
torque = { signal = "M.T", valid = "instant" }
[[bus.drives]]
position = { scale = "rad", sign = 1, zero = 0.0, wraps = "refuse", provenance = "test" }
torque = { scale = "nm", sign = 1, provenance = "test" }
[window]
trigger = { by = "command" }
[identification]
method = "idim-ls"
position_filter = { cutoff_hz = 200.0 }
decimation_filter = { factor = 5 }
[service]
[controller]
kind = "bandwidth"
timing = { kind = "sampled", sample_period_s = 1e-3 }
bandwidth_hz = [10.0]
damping = 0.8
acceleration_feed_forward = true
"#;

const AROUND_ROBOT: &str = r#"
name = "test"
gravity_m_s2 = [0.0, 0.0, -9.81]
[[joint]]
type = "revolute"
alpha_deg = 0.0
d_m = 0.0
theta_deg = 0.0
r_m = 0.0
drive_inertia = true
position_min_deg = -90.0
position_max_deg = 90.0
velocity_max_rad_s = 1.0
torque_max_nm = 100.0
[transmission]
rows = [[100.0]]
[friction]
viscous = true
coulomb = true
offset = true
sign = { model = "sign" }
"#;

/// A kind of file: its keys, the text around an example, and its reader. The reader returns the
/// content or the error.
struct File {
    keys: &'static Reference,
    around: &'static str,
    read: fn(&str) -> Result<String, String>,
}

const FILES: [File; 2] = [
    File {
        keys: &CELL,
        around: AROUND_CELL,
        read: |text| {
            let read = toml::from_str::<CellFile>(text);
            read.map(|cell| format!("{cell:?}")).map_err(|error| error.message().to_owned())
        },
    },
    File {
        keys: &ROBOT,
        around: AROUND_ROBOT,
        read: |text| {
            let read = Robot::from_toml(text);
            read.map(|robot| format!("{robot:?}")).map_err(|error| error.to_string())
        },
    },
];

impl File {
    /// Creates a complete file with the example of a section in it.
    fn with_example(&self, section: &Section) -> Table {
        let mut file: Table = self.around.parse().unwrap();
        let example: Table =
            section.example.parse().unwrap_or_else(|error| panic!("{}: {error}", section.heading));
        overlay(&mut file, example);
        file
    }

    fn read_table(&self, file: &Table) -> Result<String, String> {
        (self.read)(&toml::to_string(file).unwrap())
    }
}

/// Merges the example into the file. Tables are joined, unless they have different forms; other
/// values are replaced.
fn overlay(file: &mut Table, example: Table) {
    for (key, value) in example {
        match (file.get_mut(&key), value) {
            (Some(Value::Table(there)), Value::Table(new)) if is_one_form(there, &new) => {
                overlay(there, new);
            }
            (_, value) => {
                file.insert(key, value);
            }
        }
    }
}

fn is_one_form(there: &Table, new: &Table) -> bool {
    ["kind", "by", "model"].iter().all(|tag| there.get(*tag) == new.get(*tag))
}

fn table_at<'a>(file: &'a mut Table, path: &str) -> Option<&'a mut Table> {
    let mut table = file;
    let mut steps = path.split('.').filter(|step| !step.is_empty()).peekable();
    while let Some(step) = steps.next() {
        let mut value = table.get_mut(step)?;
        while let Some(index) = steps.peek().and_then(|step| step.parse::<usize>().ok()) {
            value = value.as_array_mut()?.get_mut(index)?;
            steps.next();
        }
        table = value.as_table_mut()?;
    }
    Some(table)
}

/// Returns the quoted words of a message, with quotes of either kind, from the list of known words
/// on.
fn listed(message: &str) -> BTreeSet<String> {
    // Message for a table of an enum variant.
    if let Some((_, list)) = message.split_once("available keys: ") {
        return list.split(", ").map(str::to_owned).collect();
    }
    let list = ["expected", "; use "].iter().find_map(|word| message.split_once(word));
    let list = list.map_or("", |(_, list)| list);
    list.split(['`', '"']).skip(1).step_by(2).map(str::to_owned).collect()
}

/// Returns the sections of each table, which may have several forms or be described in several
/// parts.
fn by_path(keys: &Reference) -> BTreeMap<&str, Vec<&'static Section>> {
    let mut paths: BTreeMap<&str, Vec<&'static Section>> = BTreeMap::new();
    for section in keys.sections() {
        paths.entry(section.path).or_default().push(section);
    }
    paths
}

fn is_form(key: &Key) -> bool {
    matches!(key.kind, Kind::Form(_))
}

/// Returns true if the table may have only one key, or the key's name as text.
fn is_choice(section: &Section) -> bool {
    section.keys.iter().all(|key| matches!(key.presence, Presence::Choice))
}

fn value(text: &str) -> Value {
    format!("value = {text}").parse::<Table>().unwrap().remove("value").unwrap()
}

#[test]
fn the_example_of_every_section_is_read_and_has_its_table() {
    for file in &FILES {
        for section in file.keys.sections() {
            let mut table = file.with_example(section);
            let read = file.read_table(&table);
            assert!(read.is_ok(), "{}: {read:?}", section.heading);
            let mut alone: Table = section.example.parse().unwrap();
            // If the table is text in the example, the section shows another of its forms.
            let is_present = table_at(&mut alone, section.path).is_some();
            assert!(is_present, "{}: the example has no `{}`", section.heading, section.path);
            assert!(table_at(&mut table, section.path).is_some());
            let form = section.keys.iter().find(|key| is_form(key));
            if let Some(Key { name, kind: Kind::Form(word), .. }) = form {
                let value = table_at(&mut alone, section.path).unwrap().get(*name).cloned();
                assert_eq!(value, Some((*word).into()), "{}", section.heading);
            }
        }
    }
}

/// An unknown key is refused with a list of the known keys. The manual has all of these and no
/// others.
#[test]
fn the_manual_has_every_key_and_no_other() {
    let mut keys = 0;
    for file in &FILES {
        for (path, sections) in by_path(file.keys) {
            let names = |sections: &[&Section]| -> BTreeSet<String> {
                let keys = sections.iter().flat_map(|section| section.keys);
                keys.filter(|key| !is_form(key)).map(|key| key.name.to_owned()).collect()
            };
            // Each form of a tagged table has its own keys; parts of one table are described
            // together.
            let tagged = sections[0].keys.iter().any(is_form) && !path.ends_with("sign");
            let groups: Vec<Vec<&Section>> = if tagged {
                sections.iter().map(|section| vec![*section]).collect()
            } else {
                vec![sections.clone()]
            };
            for group in groups {
                let mut table = file.with_example(group[0]);
                if is_choice(group[0]) {
                    let (above, name) = path.rsplit_once('.').unwrap();
                    table_at(&mut table, above)
                        .unwrap()
                        .insert(name.to_owned(), "no-such-form".into());
                } else {
                    table_at(&mut table, path).unwrap().insert("no_such_key".to_owned(), 1.into());
                }
                let message = file.read_table(&table).unwrap_err();
                let refused =
                    ["unknown", "unexpected keys"].iter().any(|word| message.contains(word));
                assert!(refused, "{path}: {message}");
                let mut keys_listed = listed(&message);
                // A tag that is not serde's own is a key like any other.
                keys_listed
                    .retain(|key| group[0].keys.iter().all(|own| !is_form(own) || own.name != key));
                assert_eq!(names(&group), keys_listed, "{}, `{path}`", file.keys.name);
                keys += keys_listed.len();
            }
        }
    }
    assert!(keys > 200, "{keys}");
}

#[test]
fn the_manual_has_every_form_and_every_word() {
    let mut words = 0;
    for file in &FILES {
        for (path, sections) in by_path(file.keys) {
            let mut kinds: BTreeMap<&str, BTreeSet<String>> = BTreeMap::new();
            for key in sections.iter().flat_map(|section| section.keys) {
                match key.kind {
                    Kind::Form(word) => {
                        kinds.entry(key.name).or_default().insert(word.to_owned());
                    }
                    Kind::Word(all) => kinds
                        .entry(key.name)
                        .or_default()
                        .extend(all.iter().map(|word| (*word).to_owned())),
                    _ => {}
                }
            }
            for (name, configured) in kinds {
                let mut file_table = file.with_example(sections[0]);
                let table = table_at(&mut file_table, path).unwrap();
                table.insert(name.to_owned(), "no-such-word".into());
                if sections[0].keys.iter().any(|key| key.name == "model") {
                    table.retain(|key, _| key == "model");
                }
                let message = file.read_table(&file_table).unwrap_err();
                assert_eq!(configured, listed(&message), "{path}.{name}: {message}");
                words += configured.len();
            }
        }
    }
    assert!(words > 40, "{words}");
}

#[test]
fn what_is_required_is_refused_when_it_is_missing_and_nothing_else_is() {
    for file in &FILES {
        for section in file.keys.sections().filter(|section| !is_choice(section)) {
            for key in section.keys {
                let mut table = file.with_example(section);
                table_at(&mut table, section.path).unwrap().remove(key.name);
                let read = file.read_table(&table);
                let place = format!("{}, {}", section.heading, key.name);
                match (&key.presence, read) {
                    (Presence::Required, Err(message)) => {
                        assert!(message.contains(key.name), "{place}: {message}");
                    }
                    (Presence::Required, Ok(_)) => panic!("{place} may be left out"),
                    // In a robot file, a key may be required with another key, and its text says
                    // so.
                    (Presence::Optional(words), Err(_)) if words.starts_with("required") => {}
                    (_, Err(message)) => panic!("{place} may not be left out: {message}"),
                    (_, Ok(_)) => {}
                }
            }
        }
    }
}

#[test]
fn a_default_is_what_holds_where_the_key_is_left_out() {
    let mut defaults = 0;
    for file in &FILES {
        for section in file.keys.sections() {
            for key in section.keys {
                let Presence::Default(text) = key.presence else { continue };
                let mut table = file.with_example(section);
                table_at(&mut table, section.path).unwrap().remove(key.name);
                let without = file.read_table(&table).unwrap();
                table_at(&mut table, section.path)
                    .unwrap()
                    .insert(key.name.to_owned(), value(text));
                assert_eq!(
                    without,
                    file.read_table(&table).unwrap(),
                    "{}: {}",
                    section.heading,
                    key.name
                );
                defaults += 1;
            }
        }
    }
    assert!(defaults > 60, "{defaults}");
}

/// The error for a value of a wrong type names the accepted types.
#[test]
fn types_are_those_that_are_read() {
    for file in &FILES {
        for section in file.keys.sections().filter(|section| !is_choice(section)) {
            for key in section.keys {
                let expected: &[&str] = match key.kind {
                    Kind::Number => &["f64"],
                    Kind::Integer => &["u8", "u16", "u32", "u64", "usize", "i64"],
                    Kind::Switch => &["a boolean"],
                    Kind::Text => &["a string"],
                    Kind::File => &["path string"],
                    // A list of three is a tuple.
                    Kind::Numbers | Kind::Texts | Kind::Tables => {
                        &["a sequence", "an array of length"]
                    }
                    Kind::Table | Kind::Word(_) | Kind::Form(_) | Kind::Other(_) => continue,
                };
                let wrong = if matches!(key.kind, Kind::Switch) { 1.5.into() } else { true.into() };
                let mut table = file.with_example(section);
                table_at(&mut table, section.path)
                    .unwrap()
                    .insert(key.name.to_owned(), Value::clone(&wrong));
                let message = file.read_table(&table).unwrap_err();
                let said =
                    expected.iter().any(|kind| message.contains(&format!("expected {kind}")));
                assert!(said, "{}, {}: {message}", section.heading, key.name);
            }
        }
    }
}

/// Uses are list entries; the checks above do not cover their words.
#[test]
fn every_use_is_reported() {
    let mut keys = CELL.sections().flat_map(|section| section.keys);
    let uses = keys.find(|key| key.name == "required_uses").unwrap();
    for each in Use::ALL {
        assert!(uses.meaning.contains(&format!("`\"{each}\"`")), "{each}");
    }
}

/// Checks that every table of a key has a section.
#[test]
fn every_table_has_a_section() {
    for file in &FILES {
        let paths: BTreeSet<String> = by_path(file.keys).into_keys().map(str::to_owned).collect();
        for section in file.keys.sections() {
            for key in section.keys {
                let entry = match key.kind {
                    Kind::Table => "",
                    Kind::Tables => ".0",
                    _ => continue,
                };
                let path = format!("{}.{}{entry}", section.path, key.name);
                let path = path.trim_start_matches('.');
                // The same law, for one joint.
                let is_documented = path == "joint.0.friction.sign" || paths.contains(path);
                assert!(is_documented, "no section of {path}");
            }
        }
    }
}

/// Checks that units match the names of the keys.
#[test]
fn units_are_those_of_the_names() {
    // Longer endings first.
    let endings = [
        ("velocity_nm_s_per_rad", "N·m·s/rad"),
        ("nm_per_a", "N·m/A"),
        ("ki_per_rad_s", "1/(rad·s)"),
        ("_s_per_rad", "s/rad"),
        ("_per_rad", "1/rad"),
        ("_per_s", "1/s"),
        ("_kg_m2", "kg·m²"),
        ("_rad_s2", "rad/s²"),
        ("_rad_s3", "rad/s³"),
        ("_rad_s", "rad/s"),
        ("_m_s2", "m/s²"),
        ("_m_s3", "m/s³"),
        ("_m_s", "m/s"),
        ("_n_m", "N/m"),
        ("_hz", "Hz"),
        ("_us", "µs"),
        ("_bps", "bit/s"),
        ("_bytes", "bytes"),
        ("_deviations", "σ"),
        ("_mb", "MB"),
        ("_db", "dB"),
        ("_deg", "°"),
        ("_rad", "rad"),
        ("_nm", "N·m"),
        ("_n", "N"),
        ("_a", "A"),
        ("_m", "m"),
        ("_s", "s"),
    ];
    let mut checked = 0;
    for section in FILES.iter().flat_map(|file| file.keys.sections()) {
        for key in section.keys {
            if let Some((_, unit)) = endings.iter().find(|(ending, _)| key.name.ends_with(ending)) {
                assert_eq!(key.unit, *unit, "{}", key.name);
                checked += 1;
            }
        }
    }
    assert!(checked > 70, "{checked}");
}
