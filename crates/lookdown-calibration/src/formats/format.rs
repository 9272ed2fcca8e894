//! The formats that are read.

use strum::{EnumIter, IntoStaticStr};

/// A format that is read. A file is in the first one whose fields it has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, IntoStaticStr, EnumIter)]
#[expect(missing_docs, reason = "the formats' own names")]
pub enum Format {
    #[strum(serialize = "native")]
    Native,
    #[strum(serialize = "Kalibr camchain")]
    Kalibr,
    #[strum(serialize = "OCamCalib")]
    OCamCalib,
    #[strum(serialize = "MultiCol-SLAM")]
    MultiCol,
    #[strum(serialize = "COLMAP cameras.txt")]
    Colmap,
    #[strum(serialize = "DSO camera.txt")]
    Dso,
    #[strum(serialize = "camodocal")]
    Camodocal,
    #[strum(serialize = "Basalt")]
    Basalt,
    #[strum(serialize = "WoodScape")]
    WoodScape,
    #[strum(serialize = "NVIDIA f-theta")]
    NvidiaFTheta,
    #[strum(serialize = "py-OCamCalib")]
    PyOCamCalib,
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
    #[strum(serialize = "ROS camera_info")]
    Ros,
    #[strum(serialize = "OpenCV FileStorage")]
    OpenCv,
}

impl Format {
    /// Returns the name under which its users know it.
    pub fn name(self) -> &'static str {
        self.into()
    }
}
