//! The precision of the networks: 8-bit integers or 32-bit floating point.

use strum::{IntoStaticStr, VariantArray};

use super::Device;

/// The precision that a user requests.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, VariantArray)]
pub enum PrecisionChoice {
    /// The fastest one on this CPU.
    #[default]
    Auto,
    /// 8-bit integers.
    Int8,
    /// 32-bit floating point.
    Fp32,
}

/// The default models that are in INT8.
#[derive(Debug, Clone, Copy, PartialEq, Eq, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Int8Use {
    /// No model.
    None,
    /// The models of `fast`, of upright crops, and SSDLite: INT8 is faster for them on any CPU, and
    /// as accurate.
    SmallProfiles,
    /// All models.
    All,
}

impl Int8Use {
    /// Returns a description for the log.
    #[must_use]
    pub fn description(self) -> &'static str {
        match self {
            Self::None => "all default models use FP32",
            Self::SmallProfiles => {
                "balanced and quality use FP32, the other default models INT8 (this CPU has no \
                 VNNI or dotprod)"
            }
            Self::All => "all default models use INT8",
        }
    }

    /// Returns the name, as in metadata and metrics.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Returns the models that are in INT8 on this machine. ONNX Runtime has integer kernels for
    /// them on CPUs only; on GPUs and neural processing units they were not measured.
    #[must_use]
    pub fn on(device: Device, choice: PrecisionChoice) -> Self {
        match choice {
            _ if !device.is_processor() => Self::None,
            PrecisionChoice::Fp32 => Self::None,
            PrecisionChoice::Auto if !cpu_has_integer_dot_product() => Self::SmallProfiles,
            PrecisionChoice::Auto | PrecisionChoice::Int8 => Self::All,
        }
    }
}

/// Returns true if this CPU has instructions for dot products of 8-bit integers: VNNI on x86-64,
/// `dotprod` on arm64. INT8 then takes less than half the time of FP32.
#[must_use]
pub fn cpu_has_integer_dot_product() -> bool {
    #[cfg(target_arch = "x86_64")]
    let has = std::arch::is_x86_feature_detected!("avx512vnni")
        || std::arch::is_x86_feature_detected!("avxvnni");
    #[cfg(target_arch = "aarch64")]
    let has = std::arch::is_aarch64_feature_detected!("dotprod");
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    let has = false;
    has
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn auto_uses_int8_for_all_profiles_with_vnni_only() {
        let expected = if cpu_has_integer_dot_product() {
            Int8Use::All
        } else {
            Int8Use::SmallProfiles
        };
        assert_eq!(Int8Use::on(Device::Cpu, PrecisionChoice::Auto), expected);
    }

    #[test]
    fn a_requested_precision_is_used_and_gpus_use_fp32() {
        assert_eq!(
            Int8Use::on(Device::Cpu, PrecisionChoice::Int8),
            Int8Use::All
        );
        assert_eq!(
            Int8Use::on(Device::Cpu, PrecisionChoice::Fp32),
            Int8Use::None
        );
        for choice in PrecisionChoice::VARIANTS {
            assert_eq!(Int8Use::on(Device::Cuda(0), *choice), Int8Use::None);
        }
    }
}
