//! The datatypes of tensors.

use serde::Serialize;
use strum::{Display, EnumString, IntoStaticStr};

/// The element type of a tensor, as far as it is used here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Display, EnumString, IntoStaticStr)]
#[cfg_attr(test, derive(strum::VariantArray))]
#[serde(rename_all = "UPPERCASE")]
#[strum(serialize_all = "UPPERCASE")]
pub enum Datatype {
    /// Text or any bytes.
    Bytes,
    /// 32-bit floating-point numbers, IEEE 754.
    Fp32,
    /// 32-bit signed integers.
    Int32,
}

impl Datatype {
    /// Returns the name, as the protocol writes it.
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
