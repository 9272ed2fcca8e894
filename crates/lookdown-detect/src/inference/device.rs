//! Device on which a network runs.

use std::{fmt, str::FromStr};

use strum::{EnumString, IntoStaticStr};

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
    /// A device of Intel, with `OpenVINO`. Operators without `OpenVINO` support run on the
    /// processor.
    OpenVino(OpenVinoDevice),
}

/// Device that `OpenVINO` runs networks on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, IntoStaticStr, EnumString)]
#[strum(serialize_all = "lowercase")]
pub enum OpenVinoDevice {
    /// The processor.
    Cpu,
    /// The first GPU.
    Gpu,
    /// The neural processing unit.
    Npu,
}

/// An invalid device name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "use cpu, cuda:N or tensorrt:N, with N the GPU's number from 0, or openvino:cpu, openvino:gpu or \
     openvino:npu"
)]
pub struct UnknownDevice;

impl Device {
    /// Returns true if the networks share the processor with the rest of the program.
    pub fn is_processor(self) -> bool {
        matches!(self, Self::Cpu | Self::OpenVino(OpenVinoDevice::Cpu))
    }

    /// Returns the name of the Python package whose ONNX Runtime can use this device.
    pub fn package(self) -> &'static str {
        match self {
            Self::Cpu => "onnxruntime",
            Self::Cuda(_) | Self::TensorRt(_) => "onnxruntime-gpu",
            Self::OpenVino(_) => "onnxruntime-openvino",
        }
    }

    /// Returns what the device needs, for messages: "check …".
    pub fn requirements(self) -> &'static str {
        match self {
            Self::Cpu | Self::OpenVino(OpenVinoDevice::Cpu) => "the library",
            Self::Cuda(_) | Self::TensorRt(_) => {
                "the GPU's number and its driver, CUDA and cuDNN libraries"
            }
            Self::OpenVino(_) => "that this machine has the device, and its driver",
        }
    }
}

impl FromStr for Device {
    type Err = UnknownDevice;

    fn from_str(name: &str) -> Result<Self, UnknownDevice> {
        if name == "cpu" {
            return Ok(Self::Cpu);
        }
        let (kind, number) = name.split_once(':').ok_or(UnknownDevice)?;
        if kind == "openvino" {
            return number
                .parse()
                .map(Self::OpenVino)
                .map_err(|_| UnknownDevice);
        }
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
            Self::OpenVino(device) => write!(f, "openvino:{}", <&str>::from(device)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_is_formatted_as_it_is_parsed() {
        for name in [
            "cpu",
            "cuda:0",
            "tensorrt:3",
            "openvino:cpu",
            "openvino:gpu",
            "openvino:npu",
        ] {
            assert_eq!(name.parse::<Device>().unwrap().to_string(), name);
        }
        for name in [
            "",
            "gpu",
            "cuda",
            "cuda:",
            "cuda:-1",
            "cuda:+1",
            "cuda:256",
            "CPU",
            "cpu:0",
            "openvino",
            "openvino:",
            "openvino:GPU",
            "openvino:0",
        ] {
            assert_eq!(name.parse::<Device>(), Err(UnknownDevice), "{name}");
        }
    }
}
