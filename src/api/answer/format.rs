//! Which form an answer takes: the parameter `format`, or what the client accepts.

use axum::http::HeaderMap;

use crate::{
    annotated_picture::PictureFormat,
    annotation_formats::AnnotationFormat,
    api::{
        accept::Accepted,
        problem::{Problem, ProblemKind},
    },
};

/// A form of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AnswerFormat {
    /// The report.
    Report,
    /// The frame with what was found drawn into it.
    Picture(PictureFormat),
    /// A file for annotation tools.
    Annotations(AnnotationFormat),
}

/// The names of the report and of pictures.
const REPORT: &str = "json";
const PICTURE: &str = "image";
const PICTURES: [(AnswerFormat, &str); 2] = [
    of_picture(PictureFormat::Jpeg),
    of_picture(PictureFormat::Png),
];
/// What a media type is enough to ask for: those of the other files are not theirs alone.
const NEGOTIABLE: [(AnswerFormat, &str); 4] = [
    (AnswerFormat::Report, AnswerFormat::Report.media_type()),
    PICTURES[0],
    PICTURES[1],
    (
        AnswerFormat::Annotations(AnnotationFormat::GeoJson),
        AnswerFormat::Annotations(AnnotationFormat::GeoJson).media_type(),
    ),
];
/// Most characters of an unknown name that are repeated to its sender.
const MAX_NAME_CHARS: usize = 64;

const fn of_picture(format: PictureFormat) -> (AnswerFormat, &'static str) {
    let format = AnswerFormat::Picture(format);
    (format, format.media_type())
}

impl AnswerFormat {
    /// The form that was named; without a name, the one that is accepted best. A name overrules
    /// `Accept`, which then only chooses between pictures.
    pub(super) fn of(name: Option<&str>, headers: &HeaderMap) -> Result<Self, Problem> {
        let accepted = Accepted::of(headers);
        match name {
            None => accepted.best_of(&NEGOTIABLE).ok_or_else(not_acceptable),
            Some(REPORT) => Ok(Self::Report),
            Some(PICTURE) => Ok(accepted.best_of(&PICTURES).unwrap_or(PICTURES[0].0)),
            Some(name) => match name.parse() {
                Ok(format) => Ok(Self::Annotations(format)),
                Err(_) => Err(unknown(name)),
            },
        }
    }

    /// What an answer in this form says it is.
    pub(super) const fn media_type(self) -> &'static str {
        match self {
            Self::Report => "application/json",
            Self::Picture(PictureFormat::Jpeg) => "image/jpeg",
            Self::Picture(PictureFormat::Png) => "image/png",
            // None is registered, and it must not be taken for the report.
            Self::Annotations(AnnotationFormat::Coco) => "application/x.coco+json",
            Self::Annotations(AnnotationFormat::Cvat | AnnotationFormat::Voc) => "application/xml",
            Self::Annotations(AnnotationFormat::Yolo) => "text/plain; charset=utf-8",
            Self::Annotations(AnnotationFormat::GeoJson) => "application/geo+json",
        }
    }
}

fn not_acceptable() -> Problem {
    let offered = NEGOTIABLE.map(|(_, media_type)| media_type).join(", ");
    let detail = format!(
        "Accept: nothing that it names is offered here: name one of {offered}, leave it out, or choose \
         with the parameter format"
    );
    Problem::new(ProblemKind::NotAcceptable, detail)
}

fn unknown(name: &str) -> Problem {
    let known = AnnotationFormat::ALL.map(AnnotationFormat::name).join(", ");
    let name: String = name.chars().take(MAX_NAME_CHARS).collect();
    let detail =
        format!("{name:?} is not a form of an answer; use one of {REPORT}, {PICTURE}, {known}");
    Problem::of_parameter(ProblemKind::InvalidParameter, "format", &detail)
}
