//! [`Field`]: a JSON value that knows its place, so that every complaint names it.
//!
//! Shapes are checked where they are read: a vector of N entries, a matrix as a list of R rows of C
//! entries each. Numbers must be finite in the scalar type they are read into. The other way,
//! [`number`], [`vector`] and [`matrix`] turn results into JSON; what is not finite becomes null.

use crate::Failure;
use nalgebra::{RealField, SMatrix, SVector};
use serde_json::Value;

/// A value and the path that led to it, e.g. `case cv_4: steps[3].z`.
#[derive(Debug, Clone)]
pub struct Field<'a> {
    value: &'a Value,
    path: String,
}

impl<'a> Field<'a> {
    /// A value known as `path` (which may be empty for a whole file).
    pub fn root(value: &'a Value, path: impl Into<String>) -> Self {
        Self { value, path: path.into() }
    }

    /// The same value under another name: fields below it are called `name: field`.
    #[must_use]
    pub fn renamed(&self, name: String) -> Self {
        Self { value: self.value, path: format!("{name}: ") }
    }

    /// The value itself.
    #[must_use]
    pub fn value(&self) -> &'a Value {
        self.value
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &str {
        self.path.trim_end_matches(": ")
    }

    /// A failure at this place.
    pub fn failure(&self, reason: impl std::fmt::Display) -> Failure {
        match self.path() {
            "" => Failure::input(reason),
            path => Failure::at_field(path, reason),
        }
    }

    /// The field `key` of an object; missing or null is a failure.
    pub fn get(&self, key: &str) -> Result<Self, Failure> {
        self.find(key)?.ok_or_else(|| self.child(self.value, key).failure("missing"))
    }

    /// The field `key` of an object; `None` when missing or null.
    pub fn find(&self, key: &str) -> Result<Option<Self>, Failure> {
        let object = self.value.as_object().ok_or_else(|| self.failure("not an object"))?;
        Ok(object.get(key).filter(|value| !value.is_null()).map(|value| self.child(value, key)))
    }

    /// The entries of a list.
    pub fn items(&self) -> Result<Vec<Self>, Failure> {
        let list = self.value.as_array().ok_or_else(|| self.failure("not a list"))?;
        let path = self.path();
        Ok(list.iter().enumerate().map(|(i, value)| Self { value, path: format!("{path}[{i}]") }).collect())
    }

    /// A text.
    pub fn text(&self) -> Result<&'a str, Failure> {
        self.value.as_str().ok_or_else(|| self.failure("not a text"))
    }

    /// True or false.
    pub fn flag(&self) -> Result<bool, Failure> {
        self.value.as_bool().ok_or_else(|| self.failure("neither true nor false"))
    }

    /// A number that counts or indexes.
    pub fn count(&self) -> Result<usize, Failure> {
        self.value.as_u64().and_then(|count| usize::try_from(count).ok()).ok_or_else(|| self.failure("not a whole number >= 0"))
    }

    /// A number, finite in `T`.
    pub fn number<T: RealField + Copy>(&self) -> Result<T, Failure> {
        let number =
            self.value.as_f64().ok_or_else(|| self.failure(if self.value.is_null() { "null, not a number" } else { "not a number" }))?;
        let converted: T = nalgebra::convert(number);
        match converted.is_finite() {
            true => Ok(converted),
            false => Err(self.failure(format!("{number:e} is out of range in this precision"))),
        }
    }

    /// A list of numbers of any length.
    pub fn numbers<T: RealField + Copy>(&self) -> Result<Vec<T>, Failure> {
        self.items()?.iter().map(Self::number).collect()
    }

    /// A list of rows of numbers, all of the same length.
    pub fn rows<T: RealField + Copy>(&self) -> Result<Vec<Vec<T>>, Failure> {
        let items = self.items()?;
        let rows: Vec<Vec<T>> = items.iter().map(Self::numbers).collect::<Result<_, _>>()?;
        let width = rows.first().map_or(0, Vec::len);
        match rows.iter().position(|row| row.len() != width) {
            Some(odd) => Err(items[odd].failure(format!("{} entries, but {width} in the row before", rows[odd].len()))),
            None => Ok(rows),
        }
    }

    /// A vector of exactly `N` numbers.
    pub fn vector<T: RealField + Copy, const N: usize>(&self) -> Result<SVector<T, N>, Failure> {
        let numbers = self.numbers()?;
        match <[T; N]>::try_from(numbers) {
            Ok(entries) => Ok(SVector::from(entries)),
            Err(numbers) => Err(self.failure(format!("{} entries where {N} belong", numbers.len()))),
        }
    }

    /// A matrix of exactly `R` rows of `C` numbers.
    pub fn matrix<T: RealField + Copy, const R: usize, const C: usize>(&self) -> Result<SMatrix<T, R, C>, Failure> {
        let rows = self.rows::<T>()?;
        let width = rows.first().map_or(0, Vec::len);
        if (rows.len(), width) != (R, C) {
            return Err(self.failure(format!("{} x {width} where {R} x {C} belongs", rows.len())));
        }
        Ok(SMatrix::from_fn(|row, column| rows[row][column]))
    }

    fn child(&self, value: &'a Value, key: &str) -> Self {
        let separator = if self.path.is_empty() || self.path.ends_with(": ") { "" } else { "." };
        Self { value, path: format!("{}{separator}{key}", self.path) }
    }
}

/// A number as JSON; null if it is not finite.
pub fn number(x: impl Into<f64>) -> Value {
    // `From<f64>` maps what JSON cannot hold to null.
    Value::from(x.into())
}

/// A list of numbers as JSON.
pub fn numbers<T: Into<f64> + Copy>(entries: &[T]) -> Value {
    entries.iter().map(|&x| number(x)).collect()
}

/// A vector as a list of numbers.
#[must_use]
pub fn vector<T: Into<f64> + Copy, const N: usize>(v: &SVector<T, N>) -> Value {
    v.iter().map(|&x| number(x)).collect()
}

/// A matrix as a list of rows.
#[must_use]
pub fn matrix<T: Into<f64> + Copy, const R: usize, const C: usize>(m: &SMatrix<T, R, C>) -> Value {
    let row = |r: usize| -> Value { (0..C).map(|c| number(m[(r, c)])).collect() };
    (0..R).map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2x3, Vector2};
    use serde_json::json;

    fn told<T>(result: Result<T, Failure>) -> Option<String> {
        result.err().map(|failure| failure.to_string())
    }

    #[test]
    fn shapes_come_back_as_they_went() -> Result<(), Failure> {
        let m = Matrix2x3::new(1.0, 2.0, 3.0, 4.0, 5.0, 1.0 / 3.0);
        let v = Vector2::new(0.1, -1e-200);
        let value = json!({"m": matrix(&m), "v": vector(&v)});
        let root = Field::root(&value, "");
        assert_eq!(root.get("m")?.matrix::<f64, 2, 3>()?, m);
        assert_eq!(root.get("v")?.vector::<f64, 2>()?, v);
        assert_eq!(value["m"][0], json!([1.0, 2.0, 3.0]));
        Ok(())
    }

    #[test]
    fn what_is_not_finite_becomes_null() {
        assert_eq!(numbers(&[1.5_f32, f32::NAN, f32::INFINITY]), json!([1.5, null, null]));
    }

    #[test]
    fn complaints_name_the_place() -> Result<(), Failure> {
        let value = json!({"P": [[1, 2], [3]], "x": [1, null], "big": 1e200, "n": -1, "s": {"t": "a"}});
        let case = Field::root(&value, "").renamed("case a".into());
        let of = |key: &str| case.get(key);
        assert_eq!(told(of("P")?.rows::<f64>()).as_deref(), Some("case a: P[1]: 1 entries, but 2 in the row before"));
        assert_eq!(told(of("x")?.vector::<f64, 2>()).as_deref(), Some("case a: x[1]: null, not a number"));
        assert_eq!(told(of("big")?.number::<f32>()).as_deref(), Some("case a: big: 1e200 is out of range in this precision"));
        assert_eq!(told(of("n")?.count()).as_deref(), Some("case a: n: not a whole number >= 0"));
        assert_eq!(told(of("s")?.get("u")).as_deref(), Some("case a: s.u: missing"));
        assert_eq!(told(of("s")?.get("t")?.flag()).as_deref(), Some("case a: s.t: neither true nor false"));
        Ok(())
    }

    #[test]
    fn wrong_sizes_are_told() {
        let value = json!([[1, 2], [3, 4]]);
        let field = Field::root(&value, "F");
        assert_eq!(told(field.matrix::<f64, 2, 3>()).as_deref(), Some("F: 2 x 2 where 2 x 3 belongs"));
        assert_eq!(told(field.vector::<f64, 2>()).as_deref(), Some("F[0]: not a number"));
        let value = json!([1, 2]);
        assert_eq!(told(Field::root(&value, "x").vector::<f64, 3>()).as_deref(), Some("x: 2 entries where 3 belong"));
    }
}
