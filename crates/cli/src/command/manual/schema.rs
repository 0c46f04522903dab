//! The keys of a table, from the JSON Schema of the type that reads the file.

use schemars::Schema;
use serde_json::Value;

/// One key of a table.
pub(super) struct Key {
    pub(super) name: String,
    /// Type of the value, in words.
    pub(super) kind: String,
    /// Unit; empty for a number without a unit, or for a value that is not a number.
    pub(super) unit: String,
    pub(super) presence: Presence,
    pub(super) meaning: String,
    /// True for the key whose word distinguishes one form of the table from the others.
    pub(super) is_form: bool,
}

/// Presence of a key: required, or the effect of leaving it out.
pub(super) enum Presence {
    Required,
    /// Value that applies if the key is left out, as written in the file.
    Default(String),
    /// Effect of leaving the key out, in words.
    Optional(String),
    /// One of several keys, of which the table has exactly one.
    Choice,
}

impl Key {
    /// Returns the row of the key in a page.
    pub(super) fn row(self) -> Vec<String> {
        let presence = self.presence.text();
        vec![format!("`{}`", self.name), self.kind, self.unit, presence, self.meaning]
    }
}

impl Presence {
    fn text(&self) -> String {
        match self {
            Self::Required => "required".to_owned(),
            Self::Default(value) => format!("`{value}`"),
            Self::Optional(words) => words.clone(),
            Self::Choice => "one of these".to_owned(),
        }
    }
}

/// The schema of a file.
pub(super) struct FileSchema(Value);

impl FileSchema {
    /// Creates the schema of a file from the schema of the type that reads the file.
    pub(super) fn new(schema: Schema) -> Self {
        Self(schema.to_value())
    }

    /// Removes the default values, which only serve results of earlier versions.
    pub(super) fn without_defaults(mut self) -> Self {
        remove_defaults(&mut self.0);
        self
    }

    /// Formats the schema for editors: descriptions without the marks of the documentation.
    pub(super) fn json(&self, title: &str) -> String {
        let mut schema = self.0.clone();
        clean_descriptions(&mut schema);
        if let Some(root) = schema.as_object_mut() {
            root.insert("title".to_owned(), title.into());
        }
        format!("{schema:#}\n")
    }

    /// Returns the keys of the table at a path such as `bus.drives.0.position`, in the order of
    /// the type's fields. `form` chooses between forms of the table.
    ///
    /// # Errors
    /// The schema does not have a step of the path, or the table does not have the form.
    pub(super) fn keys(&self, path: &str, form: Option<&str>) -> Result<Vec<Key>, String> {
        let mut schema = self.resolve_reference(&self.0);
        for step in path.split('.').filter(|step| !step.is_empty()) {
            schema = self.step(schema, step).ok_or_else(|| format!("`{path}` has no `{step}`"))?;
        }
        let forms = self.value_forms(schema);
        let table = match form {
            Some(word) => forms.iter().find(|table| form_key(table) == Some(word)),
            None => forms.iter().find(|_| forms.len() == 1),
        };
        match (table, form) {
            (Some(table), _) => Ok(self.keys_of(table)),
            (None, None) => Ok(forms.iter().filter_map(|form| self.choice_key(form)).collect()),
            (None, Some(word)) => Err(format!("`{path}` has no form `{word}`")),
        }
    }

    /// Resolves references. Replaces the schema of an optional value by the schema of the value.
    fn resolve_reference<'a>(&'a self, schema: &'a Value) -> &'a Value {
        let reference = schema.get("$ref").and_then(Value::as_str);
        let definition = reference.and_then(|path| self.0.pointer(path.trim_start_matches('#')));
        if let Some(definition) = definition {
            return self.resolve_reference(definition);
        }
        let alternatives = schema.get("anyOf").and_then(Value::as_array);
        match alternatives.map(Vec::as_slice) {
            Some([value, null]) if null.get("type") == Some(&"null".into()) => {
                self.resolve_reference(value)
            }
            _ => schema,
        }
    }

    /// Returns the forms that a value may have; the schema itself if the value has only one form.
    fn value_forms<'a>(&'a self, schema: &'a Value) -> Vec<&'a Value> {
        match alternatives(schema) {
            Some(forms) => forms.iter().map(|form| self.resolve_reference(form)).collect(),
            None => vec![schema],
        }
    }

    fn step<'a>(&'a self, schema: &'a Value, step: &str) -> Option<&'a Value> {
        let next = |form: &'a Value| match step.parse::<usize>() {
            Ok(_) => form.get("items"),
            Err(_) => form.get("properties")?.get(step),
        };
        self.value_forms(schema)
            .into_iter()
            .find_map(next)
            .map(|schema| self.resolve_reference(schema))
    }

    fn keys_of(&self, table: &Value) -> Vec<Key> {
        let required = table.get("required").and_then(Value::as_array);
        let properties = table.get("properties").and_then(Value::as_object);
        let keys = properties.into_iter().flatten().map(|(name, schema)| {
            let is_required = required.is_some_and(|keys| keys.contains(&name.as_str().into()));
            self.key(name, schema, description(schema), is_required)
        });
        keys.collect()
    }

    fn key(&self, name: &str, schema: &Value, description: &str, is_required: bool) -> Key {
        let description = Description::parse(description);
        let default = schema.get("default").filter(|value| !value.is_null());
        let presence = match (description.left_out, default) {
            (Some(words), _) if words == "required" => Presence::Required,
            (Some(words), _) => match words.strip_prefix('`').and_then(|w| w.strip_suffix('`')) {
                Some(value) if !value.contains('`') => Presence::Default(value.to_owned()),
                _ => Presence::Optional(words),
            },
            (None, _) if is_required => Presence::Required,
            (None, Some(Value::Object(table))) if !table.is_empty() => {
                Presence::Optional("as its defaults say".to_owned())
            }
            (None, Some(value)) => Presence::Default(toml_value(value)),
            (None, None) => Presence::Optional("none".to_owned()),
        };
        let is_form = schema.get("const").is_some();
        let kind = self.kind(schema, GrammaticalNumber::Singular);
        let Description { unit, mut meaning, .. } = description;
        if is_form && meaning.is_empty() {
            meaning = "The form.".to_owned();
        }
        Key { name: name.to_owned(), kind, unit, presence, meaning, is_form }
    }

    /// Describes one form of a value as a key: a table with exactly one key, or a fixed word.
    fn choice_key(&self, form: &Value) -> Option<Key> {
        let properties = form.get("properties").and_then(Value::as_object);
        let (name, kind) = match properties.and_then(|keys| keys.iter().next()) {
            Some((name, schema)) => (name.as_str(), self.kind(schema, GrammaticalNumber::Singular)),
            None => (form.get("const")?.as_str()?, "none".to_owned()),
        };
        let mut key = self.key(name, form, description(form), true);
        key.kind = kind;
        key.presence = Presence::Choice;
        key.is_form = false;
        Some(key)
    }

    /// Returns the type of a value in words.
    fn kind(&self, schema: &Value, number: GrammaticalNumber) -> String {
        let schema = self.resolve_reference(schema);
        if let Some(words) = schema.get("enum").and_then(Value::as_array) {
            return words.iter().map(literal_text).collect::<Vec<_>>().join(", ");
        }
        if let Some(word) = schema.get("const") {
            return literal_text(word);
        }
        if let Some(forms) = alternatives(schema) {
            let mut kinds: Vec<String> = Vec::new();
            for kind in forms.iter().map(|form| self.kind(form, number)) {
                if !kinds.contains(&kind) {
                    kinds.push(kind);
                }
            }
            // Literal words come first: "`\"auto\"`, or a number".
            kinds.sort_by_key(|kind| !kind.starts_with('`'));
            for kind in kinds.iter_mut().skip(1).filter(|kind| !kind.starts_with('`')) {
                kind.insert_str(0, number.alternative());
            }
            return kinds.join(", ");
        }
        let name = match schema.get("type") {
            Some(Value::Array(types)) => types.first().and_then(Value::as_str),
            other => other.and_then(Value::as_str),
        };
        match name {
            Some("boolean") => "`true` or `false`".to_owned(),
            Some("array") => {
                let items = schema.get("items").unwrap_or(&Value::Null);
                format!(
                    "{} of {}",
                    number.with_noun("list"),
                    self.kind(items, GrammaticalNumber::Plural)
                )
            }
            Some("object") => {
                match schema.get("additionalProperties").filter(|of| of.is_object()) {
                    Some(values) if values.get("type").is_some() => {
                        format!(
                            "{} of {}",
                            number.with_noun("table"),
                            self.kind(values, GrammaticalNumber::Plural)
                        )
                    }
                    _ => number.with_noun("table"),
                }
            }
            Some("number") => number.with_noun("number"),
            Some("integer") => number.with_noun("whole number"),
            _ => number.with_noun("text"),
        }
    }
}

#[derive(Clone, Copy)]
enum GrammaticalNumber {
    Singular,
    Plural,
}

impl GrammaticalNumber {
    /// Returns the words before a further alternative.
    fn alternative(self) -> &'static str {
        match self {
            Self::Singular => "or a ",
            Self::Plural => "or ",
        }
    }

    fn with_noun(self, noun: &str) -> String {
        match self {
            Self::Singular => noun.to_owned(),
            Self::Plural => format!("{noun}s"),
        }
    }
}

fn alternatives(schema: &Value) -> Option<&Vec<Value>> {
    schema.get("oneOf").or_else(|| schema.get("anyOf")).and_then(Value::as_array)
}

/// Returns the word that distinguishes this form of a table.
fn form_key(table: &Value) -> Option<&str> {
    let properties = table.get("properties")?.as_object()?;
    properties.values().find_map(|schema| schema.get("const")?.as_str())
}

fn literal_text(value: &Value) -> String {
    format!("`{value}`")
}

fn toml_value(value: &Value) -> String {
    toml::Value::try_from(value).map_or_else(|_| value.to_string(), |value| value.to_string())
}

fn description(schema: &Value) -> &str {
    schema.get("description").and_then(Value::as_str).unwrap_or_default()
}

/// The parts of a field's documentation.
struct Description {
    meaning: String,
    /// The unit, which is written in the documentation between `\[` and `\]`.
    unit: String,
    /// Effect of leaving the key out, from the last paragraph, if that paragraph states the effect.
    left_out: Option<String>,
}

impl Description {
    fn parse(text: &str) -> Self {
        let mut paragraphs: Vec<String> =
            text.split("\n\n").map(|lines| lines.replace('\n', " ").trim().to_owned()).collect();
        let mut left_out = None;
        if let Some(last) = paragraphs.last() {
            let words = last.strip_suffix('.').unwrap_or(last);
            left_out = match words.strip_prefix("If left out: ") {
                Some(effect) => Some(effect.to_owned()),
                None => words.strip_prefix("Required").map(|when| format!("required{when}")),
            };
        }
        if left_out.is_some() {
            paragraphs.pop();
        }
        let text = paragraphs.join(" ");
        let (unit, text) = match text.split_once("\\[").map(|(a, b)| (a, b.split_once("\\]"))) {
            Some((before, Some((unit, after)))) => {
                (unit.to_owned(), format!("{}{after}", before.trim_end()))
            }
            _ => (String::new(), text),
        };
        Self { meaning: without_marks(&text), unit, left_out }
    }
}

/// Removes the marks that only rustdoc needs: escapes, and the brackets of links.
fn without_marks(text: &str) -> String {
    text.replace("\\[", "[").replace("\\]", "]").replace("[`", "`").replace("`]", "`")
}

/// Removes the default values from a schema. A property that is called `default` has a schema and
/// stays.
fn remove_defaults(schema: &mut Value) {
    match schema {
        Value::Object(map) => {
            map.retain(|key, value| key != "default" || value.get("type").is_some());
            map.values_mut().for_each(remove_defaults);
        }
        Value::Array(values) => values.iter_mut().for_each(remove_defaults),
        _ => {}
    }
}

fn clean_descriptions(schema: &mut Value) {
    match schema {
        Value::Object(map) => {
            for (key, value) in map {
                match value {
                    Value::String(text) if key == "description" => *text = without_marks(text),
                    value => clean_descriptions(value),
                }
            }
        }
        Value::Array(values) => values.iter_mut().for_each(clean_descriptions),
        _ => {}
    }
}
