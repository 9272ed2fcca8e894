//! The fields of a document, read so that every refusal names the field, its value and the remedy.

use lookdown_lens::saturating::to_u32;
use serde_json::{Map, Value};

use super::FormatError;
use crate::native::NativeImage;

/// A map of a document that knows its own name.
#[derive(Debug, Clone)]
pub(super) struct Fields<'a> {
    name: String,
    /// The map of keys to values.
    pub(super) map: &'a Map<String, Value>,
}

impl<'a> Fields<'a> {
    /// The document itself.
    pub(super) fn new(tree: &'a Value) -> Result<Self, FormatError> {
        let map = tree
            .as_object()
            .ok_or_else(|| FormatError::malformed("it has no named fields at its top"))?;
        Ok(Self {
            name: String::new(),
            map,
        })
    }

    /// The name of a field, with the fields it lies in.
    pub(super) fn name_of(&self, key: &str) -> String {
        if self.name.is_empty() {
            key.to_owned()
        } else {
            format!("{}.{key}", self.name)
        }
    }

    /// A refusal of one field.
    pub(super) fn invalid(&self, key: &str, problem: impl Into<String>) -> FormatError {
        FormatError::invalid(self.name_of(key), problem)
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.map.contains_key(key)
    }

    pub(super) fn get(&self, key: &str) -> Result<&'a Value, FormatError> {
        self.map
            .get(key)
            .ok_or_else(|| self.invalid(key, "it is missing from the file"))
    }

    /// A field that is a map itself.
    pub(super) fn child(&self, key: &str) -> Result<Self, FormatError> {
        let map = self.get(key)?.as_object();
        Ok(Self {
            name: self.name_of(key),
            map: map.ok_or_else(|| self.invalid(key, "named fields are needed here"))?,
        })
    }

    /// This map, or the one in the field if there is one.
    pub(super) fn or_child(&self, key: &str) -> Result<Self, FormatError> {
        if self.has(key) {
            self.child(key)
        } else {
            Ok(self.clone())
        }
    }

    /// The entries of a list of maps; none where there is no list.
    pub(super) fn entries(&self, key: &str) -> impl Iterator<Item = Result<Self, FormatError>> {
        let list = self.map.get(key).and_then(Value::as_array);
        (0..list.map_or(0, Vec::len)).map(move |index| self.entry(key, index))
    }

    fn entry(&self, key: &str, index: usize) -> Result<Self, FormatError> {
        let name = format!("{key}[{index}]");
        let map = self
            .get(key)?
            .get(index)
            .and_then(Value::as_object)
            .ok_or_else(|| self.invalid(&name, "named fields are needed here"))?;
        Ok(Self {
            name: self.name_of(&name),
            map,
        })
    }

    /// A map that lies in this one.
    pub(super) fn inside(&self, name: &str, map: &'a Map<String, Value>) -> Self {
        Self {
            name: self.name_of(name),
            map,
        }
    }

    pub(super) fn text(&self, key: &str) -> Result<&'a str, FormatError> {
        let value = self.get(key)?;
        value
            .as_str()
            .ok_or_else(|| self.invalid(key, format!("it is {}: a text is needed", brief(value))))
    }

    pub(super) fn number(&self, key: &str) -> Result<f64, FormatError> {
        let value = self.get(key)?;
        number(value)
            .ok_or_else(|| self.invalid(key, format!("it is {}: a number is needed", brief(value))))
    }

    /// The numbers of several fields.
    pub(super) fn each<const N: usize>(&self, keys: [&str; N]) -> Result<[f64; N], FormatError> {
        let mut numbers = [0.0; N];
        for (number, key) in numbers.iter_mut().zip(keys) {
            *number = self.number(key)?;
        }
        Ok(numbers)
    }

    /// Numbers that are 0 where they are missing.
    pub(super) fn optional<const N: usize>(
        &self,
        keys: [&str; N],
    ) -> Result<[f64; N], FormatError> {
        let mut numbers = [0.0; N];
        for (number, key) in numbers.iter_mut().zip(keys) {
            *number = self.number_or(key, 0.0)?;
        }
        Ok(numbers)
    }

    pub(super) fn number_or(&self, key: &str, default: f64) -> Result<f64, FormatError> {
        if self.has(key) {
            self.number(key)
        } else {
            Ok(default)
        }
    }

    /// All the numbers of a list, of a list of lists row by row, or of a matrix with `data`.
    pub(super) fn numbers(&self, key: &str) -> Result<Vec<f64>, FormatError> {
        let value = self.get(key)?;
        let value = value.get("data").unwrap_or(value);
        let mut numbers = Vec::new();
        if flatten(value, &mut numbers) {
            Ok(numbers)
        } else {
            Err(self.invalid(key, format!("it is {}: numbers are needed", brief(value))))
        }
    }

    /// Exactly `N` numbers; `expected` says which.
    pub(super) fn exactly<const N: usize>(
        &self,
        key: &str,
        expected: &str,
    ) -> Result<[f64; N], FormatError> {
        let numbers = self.numbers(key)?;
        exactly(numbers, expected).map_err(|problem| self.invalid(key, problem))
    }

    /// The frame size, from two fields.
    pub(super) fn image(&self, width: &str, height: &str) -> Result<NativeImage, FormatError> {
        Ok(NativeImage {
            width: self.side(width, self.number(width)?)?,
            height: self.side(height, self.number(height)?)?,
        })
    }

    /// The frame size, from a field with width and height, in this order.
    pub(super) fn image_pair(&self, key: &str) -> Result<NativeImage, FormatError> {
        let [width, height] = self.exactly(key, "width and height")?;
        Ok(NativeImage {
            width: self.side(key, width)?,
            height: self.side(key, height)?,
        })
    }

    fn side(&self, key: &str, pixels: f64) -> Result<u32, FormatError> {
        side(pixels).map_err(|problem| self.invalid(key, problem))
    }
}

/// Exactly `N` numbers, or the problem; `expected` says which.
pub(super) fn exactly<const N: usize>(
    numbers: Vec<f64>,
    expected: &str,
) -> Result<[f64; N], String> {
    let count = numbers.len();
    let numbers = numbers.try_into();
    numbers.map_err(|_| format!("it has {count} numbers: {N} are needed, {expected}"))
}

/// The side of a frame, or the problem.
pub(super) fn side(pixels: f64) -> Result<u32, String> {
    let problem = || format!("it is {pixels}: a whole number of pixels is needed");
    whole_pixels(pixels).ok_or_else(problem)
}

/// A count of pixels that some formats write as a decimal number.
pub(super) fn whole_pixels(pixels: f64) -> Option<u32> {
    let fits = pixels.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&pixels);
    fits.then_some(to_u32(pixels))
}

/// Collects numbers in the order in which they are written; false when something else is there.
fn flatten(value: &Value, numbers: &mut Vec<f64>) -> bool {
    match value {
        Value::Array(items) => items.iter().all(|item| flatten(item, numbers)),
        _ => number(value).map(|number| numbers.push(number)).is_some(),
    }
}

/// A number, which some programs write as a text.
fn number(value: &Value) -> Option<f64> {
    let written = || value.as_str()?.trim().parse().ok();
    value.as_f64().or_else(written)
}

/// A value as it may be shown in a sentence.
fn brief(value: &Value) -> String {
    match value {
        Value::Object(_) => "a map".to_owned(),
        Value::Array(_) => "a list".to_owned(),
        Value::String(text) => format!("{:?}", text.chars().take(40).collect::<String>()),
        Value::Null => "empty".to_owned(),
        _ => value.to_string(),
    }
}
