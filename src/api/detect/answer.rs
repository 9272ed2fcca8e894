//! The response to a frame: the report as JSON, the annotated image, or a file for annotation
//! tools.

mod format;

use axum::http::HeaderMap;
use bytes::Bytes;
use lookdown_detect::pipeline::{DetectedFrame, PipelineError};

use self::format::AnswerFormat;
pub(in crate::api) use self::format::TABLE;
use crate::{
    annotated_image::{AnnotationError, AnnotationOptions, annotated_image},
    annotation_formats::AnnotatedImage,
    api::http::{
        problem::{Problem, ProblemKind},
        query::{pairs, take},
    },
};

/// The name of a frame that was sent without a file name.
const NAMELESS: &str = "frame";

/// The requested form of the response.
pub(in crate::api) struct AnswerOptions {
    format: AnswerFormat,
    image_options: AnnotationOptions,
    /// The file name of the frame as the client sent it.
    file_name: Option<String>,
}

/// The content of a response.
pub(in crate::api) struct Content {
    pub(in crate::api) media_type: &'static str,
    pub(in crate::api) bytes: Bytes,
}

impl AnswerOptions {
    /// Takes the parameters of the response out of those of a request.
    pub(in crate::api) fn take_from(
        given: &mut Vec<(String, String)>,
        headers: &HeaderMap,
        file_name: Option<String>,
    ) -> Result<Self, Problem> {
        let format = take(given, TABLE);
        let image_options = take(given, AnnotationOptions::TABLE);
        Ok(Self {
            format: AnswerFormat::read(pairs(&format), headers)?,
            image_options: AnnotationOptions::parse(pairs(&image_options))?,
            file_name,
        })
    }

    /// Returns the width of the annotated image, pixels; 0 for other formats.
    pub(in crate::api) fn drawn_width(&self) -> u32 {
        match self.format {
            AnswerFormat::Image(_) => self.image_options.width,
            AnswerFormat::Report | AnswerFormat::Annotations(..) => 0,
        }
    }

    /// Builds the response for a frame whose report is `json`. Drawing blocks: call it on a worker
    /// thread.
    pub(in crate::api) fn content(
        self,
        detected: DetectedFrame,
        json: &Bytes,
    ) -> Result<Content, Problem> {
        let report = &detected.report;
        let bytes = match self.format {
            AnswerFormat::Report => json.clone(),
            AnswerFormat::Image(format) => {
                let image = annotated_image(detected, format, &self.image_options);
                image.map_err(not_drawn)?.into()
            }
            AnswerFormat::Annotations(format, boxes) => {
                let name = self.file_name.unwrap_or_else(|| NAMELESS.to_owned());
                let image = AnnotatedImage::new(report, name);
                format.document(&image, boxes).into()
            }
        };
        Ok(Content {
            media_type: self.format.media_type(),
            bytes,
        })
    }
}

fn not_drawn(error: AnnotationError) -> Problem {
    match error {
        AnnotationError::Cancelled(_) => PipelineError::Withdrawn.into(),
        AnnotationError::Encode(error) => {
            Problem::new(ProblemKind::UnfitImage, format!("{error}: ask for a width"))
                .with_parameter("width")
        }
    }
}
