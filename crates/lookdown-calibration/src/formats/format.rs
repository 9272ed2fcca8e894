//! The formats that are read.

use strum::IntoStaticStr;

/// A format that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, IntoStaticStr)]
#[expect(missing_docs, reason = "the formats' own names")]
pub enum Format {
    #[strum(serialize = "native")]
    Native,
    #[strum(serialize = "Kalibr camchain")]
    Kalibr,
    #[strum(serialize = "OpenCV FileStorage")]
    OpenCv,
    #[strum(serialize = "ROS camera_info")]
    Ros,
    #[strum(serialize = "OCamCalib")]
    OCamCalib,
    #[strum(serialize = "py-OCamCalib")]
    PyOCamCalib,
    #[strum(serialize = "MultiCol-SLAM")]
    MultiCol,
    #[strum(serialize = "COLMAP cameras.txt")]
    Colmap,
    #[strum(serialize = "camodocal")]
    Camodocal,
    #[strum(serialize = "Basalt")]
    Basalt,
    #[strum(serialize = "WoodScape")]
    WoodScape,
    #[strum(serialize = "NVIDIA f-theta")]
    NvidiaFTheta,
    #[strum(serialize = "MOIL")]
    Moil,
    #[strum(serialize = "fisheye-calib-adapter")]
    FisheyeCalibAdapter,
    #[strum(serialize = "camera-intrinsic-model")]
    CameraIntrinsicModel,
    #[strum(serialize = "SLAM settings")]
    Slam,
    #[strum(serialize = "nerfstudio transforms.json")]
    Nerfstudio,
    #[strum(serialize = "gyroflow lens profile")]
    Gyroflow,
    #[strum(serialize = "DepthAI")]
    DepthAi,
    #[strum(serialize = "OpenSfM camera_models.json")]
    OpenSfm,
    #[strum(serialize = "MATLAB fisheyeIntrinsics")]
    Matlab,
    #[strum(serialize = "AliceVision")]
    AliceVision,
}

impl Format {
    /// Returns the name under which its users know it.
    pub fn name(self) -> &'static str {
        self.into()
    }
}
