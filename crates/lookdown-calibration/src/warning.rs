//! Warnings of reports and calibrations: a stable code for programs and a sentence for people. A
//! new code is one entry of the table here; its row in docs/http.md follows from it.

use std::fmt;

/// Declares the codes: a description, then `Variant = "name";`.
macro_rules! warnings {
    ($($(#[doc = $description:literal])+ $code:ident = $name:literal;)+) => {
        /// The code of a warning.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum WarningCode {
            $($(#[doc = $description])+ $code,)+
        }

        impl WarningCode {
            /// Every code, in the order of the table.
            pub const ALL: &[Self] = &[$(Self::$code),+];

            /// The stable name.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$code => $name,)+
                }
            }

            /// The meaning, as one sentence.
            pub fn description(self) -> &'static str {
                match self {
                    $(Self::$code => concat!($($description),+).trim_ascii_start(),)+
                }
            }
        }
    };
}

warnings! {
    /// The frame was rotated according to its EXIF orientation; boxes are in pixels of the rotated
    /// frame.
    FrameRotated = "frame-rotated";
    /// The request named no calibration: the lens was assumed from the lens circle of the frame.
    LensAssumed = "lens-assumed";
    /// The frame shows no lens circle: the assumed circle is the largest one in the middle of the
    /// frame.
    LensCircleNotFound = "lens-circle-not-found";
    /// The calibration file does not name its lens model: the reader chose one.
    LensModelAssumed = "lens-model-assumed";
    /// The lens function ends before the field of view that the calibration file states.
    FieldOfViewReduced = "field-of-view-reduced";
    /// The principal point of the calibration is far from the middle of the frame.
    PrincipalPointOffCenter = "principal-point-off-center";
    /// The horizontal and vertical focal lengths of the calibration differ by more than 5 %.
    FocalLengthsDiffer = "focal-lengths-differ";
    /// The field of view of the calibration is small for a ceiling fisheye.
    FieldOfViewNarrow = "field-of-view-narrow";
    /// A privacy mask of the calibration hides less than 0.1 % of the frame.
    MaskSmall = "mask-small";
}

/// A circumstance that a reader of a report or of a calibration should consider.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// The code, for programs.
    pub code: WarningCode,
    /// The circumstance with its values, as one sentence for people.
    pub message: String,
}

impl Warning {
    /// Creates a warning with a message of one sentence.
    pub fn new(code: WarningCode, message: impl Into<String>) -> Self {
        Self {
            code,
            message: message.into(),
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} ({})", self.message, self.code.name())
    }
}
