//! Detection in a frame, from the upload to the answer: the route `POST /detect`, and the parts
//! that the other protocols share with it.

pub(super) mod answer;
pub(super) mod report;
pub(super) mod route;
pub(super) mod run;
pub(super) mod upload;
