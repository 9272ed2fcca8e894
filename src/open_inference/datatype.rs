//! What the elements of a tensor are.

use serde::Serialize;
use strum::{Display, EnumString, IntoStaticStr};

/// What the elements of a tensor are, of all that the protocol has those that are used here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Display, EnumString, IntoStaticStr)]
#[cfg_attr(test, derive(strum::VariantArray))]
#[serde(rename_all = "UPPERCASE")]
#[strum(serialize_all = "UPPERCASE")]
pub enum Datatype {
    /// Texts, or bytes of any kind.
    Bytes,
    /// Numbers of 32 bits, IEEE 754.
    Fp32,
    /// Whole numbers of 32 bits.
    Int32,
    /// Whole numbers 0 to 255.
    Uint8,
}

impl Datatype {
    /// Returns the name, as the protocol writes it.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }
}

#[cfg(test)]
mod tests {
    use strum::VariantArray;

    use super::*;

    #[test]
    fn a_datatype_is_written_as_it_is_named() {
        for &datatype in Datatype::VARIANTS {
            let name = datatype.to_string();
            assert_eq!(serde_json::to_value(datatype).unwrap(), name);
            assert_eq!(name.parse(), Ok(datatype));
        }
        assert!("FP16".parse::<Datatype>().is_err());
    }
}
