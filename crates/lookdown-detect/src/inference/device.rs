//! Device on which a network runs.

use std::{fmt, str::FromStr};

/// Highest accepted device number. No machine has more devices.
const MAX_DEVICE: i32 = 255;

/// Device on which networks run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Device {
    /// The processor.
    #[default]
    Cpu,
    /// An NVIDIA GPU, by its number, with CUDA.
    Cuda(i32),
    /// An NVIDIA GPU, by its number, with `TensorRT`. Operators without `TensorRT` support run with
    /// CUDA.
    TensorRt(i32),
}

/// An invalid device name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("use cpu, cuda:N or tensorrt:N, with N the GPU's number from 0")]
pub struct UnknownDevice;

impl FromStr for Device {
    type Err = UnknownDevice;

    fn from_str(name: &str) -> Result<Self, UnknownDevice> {
        if name == "cpu" {
            return Ok(Self::Cpu);
        }
        let (kind, number) = name.split_once(':').ok_or(UnknownDevice)?;
        let plain = number.bytes().all(|digit| digit.is_ascii_digit());
        let number = number.parse().ok().filter(|_| plain);
        let number = number
            .filter(|number| (0..=MAX_DEVICE).contains(number))
            .ok_or(UnknownDevice)?;
        match kind {
            "cuda" => Ok(Self::Cuda(number)),
            "tensorrt" => Ok(Self::TensorRt(number)),
            _ => Err(UnknownDevice),
        }
    }
}

impl fmt::Display for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cpu => f.write_str("cpu"),
            Self::Cuda(number) => write!(f, "cuda:{number}"),
            Self::TensorRt(number) => write!(f, "tensorrt:{number}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_is_formatted_as_it_is_parsed() {
        for name in ["cpu", "cuda:0", "tensorrt:3"] {
            assert_eq!(name.parse::<Device>().unwrap().to_string(), name);
        }
        for name in [
            "", "gpu", "cuda", "cuda:", "cuda:-1", "cuda:+1", "cuda:256", "CPU", "cpu:0",
        ] {
            assert_eq!(name.parse::<Device>(), Err(UnknownDevice), "{name}");
        }
    }
}
