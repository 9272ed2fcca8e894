//! The datatypes of tensors.

use std::fmt;

use serde::Serialize;

/// The datatype of a tensor's elements. Only those of the protocol that Lookdown uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum Datatype {
    /// Text or any bytes.
    Bytes,
    /// 32-bit floating-point numbers, IEEE 754.
    Fp32,
    /// 32-bit signed integers.
    Int32,
    /// Integers from 0 to 255.
    Uint8,
}

impl Datatype {
    const ALL: [Self; 4] = [Self::Bytes, Self::Fp32, Self::Int32, Self::Uint8];

    /// Returns the datatype of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let mut all = Self::ALL.into_iter();
        all.find(|datatype| datatype.name() == name)
    }

    /// The name in the protocol.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Bytes => "BYTES",
            Self::Fp32 => "FP32",
            Self::Int32 => "INT32",
            Self::Uint8 => "UINT8",
        }
    }
}

impl fmt::Display for Datatype {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_datatype_is_written_as_it_is_named() {
        for datatype in Datatype::ALL {
            let written = serde_json::to_value(datatype).unwrap();
            assert_eq!(written, datatype.name());
            assert_eq!(Datatype::named(datatype.name()), Some(datatype));
        }
        assert_eq!(Datatype::named("FP16"), None);
    }
}
