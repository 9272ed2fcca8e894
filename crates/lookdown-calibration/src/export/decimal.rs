//! Numbers as every YAML reader takes them for numbers.

use std::fmt::{self, Display};

/// Written so that it reads back as the same `f64`.
///
/// YAML 1.1 readers such as `PyYAML` take `1e-7` for a text: a point and a sign are put in.
pub(super) struct Decimal(pub(super) f64);

impl Display for Decimal {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shortest = format!("{:?}", self.0);
        let Some((mantissa, exponent)) = shortest.split_once('e') else {
            return formatter.write_str(&shortest);
        };
        let point = if mantissa.contains('.') { "" } else { ".0" };
        let sign = if exponent.starts_with('-') { "" } else { "+" };
        write!(formatter, "{mantissa}{point}e{sign}{exponent}")
    }
}

/// Numbers with a separator between them.
pub(super) fn join(numbers: &[f64], separator: &str) -> String {
    let decimals: Vec<_> = numbers
        .iter()
        .map(|&number| Decimal(number).to_string())
        .collect();
    decimals.join(separator)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_have_a_point_and_a_sign() {
        for (number, expected) in [
            (1e-7, "1.0e-7"),
            (-1.5e-7, "-1.5e-7"),
            (1e20, "1.0e+20"),
            (0.1, "0.1"),
            (3.0, "3.0"),
        ] {
            assert_eq!(Decimal(number).to_string(), expected);
        }
    }
}
