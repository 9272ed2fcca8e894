//! A search for request bodies whose parsing takes more than linear time: forms, and tensors in
//! JSON and as bytes.
//!
//! Each filler is inserted into a valid body at its place, at two sizes. The larger body is eight
//! times as large, and so may be its time. A square takes 64 times, and the limit is between both.

use std::time::{Duration, Instant};

use axum::{body::Body, http::Request};

use crate::service::{Bounds, Service, with_host};

const GROWTH: usize = 8;
const MAX_RATIO: f64 = 22.0;
/// Shorter times are noise.
const LEAST: Duration = Duration::from_millis(1);
/// Measurements of a ratio that seems too large.
const ROUNDS: usize = 8;
/// Filler of the larger body, bytes.
const BYTES: usize = 256 << 10;
/// The place of the filler in a body.
const PLACE: &str = "<>";

const FORM: &str = "multipart/form-data; boundary=edge";
const FORMS: [&str; 6] = [
    "<>\r\n--edge--\r\n",
    "--edge\r\nContent-Disposition: form-data; name=\"img\"<>\r\n\r\nx\r\n--edge--\r\n",
    "--edge\r\nContent-Disposition: form-data; name=\"<>\"\r\n\r\nx\r\n--edge--\r\n",
    "--edge\r\n<>\r\n\r\nx\r\n--edge--\r\n",
    "--edge\r\nContent-Disposition: form-data; name=\"img\"\r\n\r\n<>\r\n--edge--\r\n",
    "--edge\r\nContent-Disposition: form-data; name=\"profile\"\r\n\r\n<>\r\n--edge--\r\n",
];
const FORM_FILLERS: [&str; 12] = [
    "a",
    " ",
    "\r\n",
    "\n",
    "--edge\r\n",
    "--edg",
    "\r\n--edge\r\nContent-Disposition: form-data; name=\"profile\"\r\n\r\nfast",
    "--edge\r\n\r\n\r\n",
    "X-A: b\r\n",
    "; a=b",
    "\\\"",
    "\r\n--edg",
];

const TENSORS: [&str; 6] = [
    "<>",
    "{\"inputs\":[{\"name\":\"image\",\"shape\":[1],\"datatype\":\"BYTES\",\"data\":[\"<>\"]}]}",
    "{\"inputs\":[{\"name\":\"image\",\"shape\":[1],\"datatype\":\"BYTES\",\"data\":[<>1]}]}",
    "{\"inputs\":[<>1]}",
    "{\"parameters\":{<>\"a\":1},\"inputs\":[]}",
    "{\"<>\":1,\"inputs\":[]}",
];
const TENSOR_FILLERS: [&str; 14] = [
    "a",
    "1",
    "1,",
    "1e9,",
    "[",
    "[1],",
    "{\"a\":",
    "\"a\":1,",
    "\"b#\":1,",
    "{},",
    "\"\",",
    "\\u0041",
    " ",
    "{\"name\":\"image\",\"shape\":[1],\"datatype\":\"BYTES\",\"data\":[\"YQ==\"]},",
];

/// The end of the JSON in a body whose tensors are bytes.
const HEAD_END: &str = "|";
const BINARY_TENSORS: [&str; 8] = [
    "<>|",
    "{\"inputs\":[{\"name\":\"image\",\"shape\":[1],\"datatype\":\"BYTES\",\
     \"parameters\":{\"binary_data_size\":9}}]}|<>",
    "{\"inputs\":[{\"name\":\"image\",\"shape\":[1],\"datatype\":\"BYTES\",\
     \"parameters\":{\"binary_data_size\":<>9}}]}|",
    "{\"inputs\":[{\"name\":\"image\",\"shape\":[<>1],\"datatype\":\"FP32\",\
     \"parameters\":{\"binary_data_size\":9}}]}|123456789",
    "{\"inputs\":[{\"name\":\"<>\",\"shape\":[1],\"datatype\":\"<>\",\
     \"parameters\":{\"binary_data_size\":9}}]}|123456789",
    "{\"inputs\":[{\"name\":\"image\",\"shape\":[1],\"datatype\":\"BYTES\",\
     \"parameters\":{<>\"binary_data_size\":9}}]}|123456789",
    "{\"inputs\":[<>1]}|<>",
    "{\"outputs\":[<>1],\"inputs\":[]}|",
];
const BINARY_FILLERS: [&str; 9] = [
    "a",
    "1",
    "1,",
    "[",
    "\"b#\":1,",
    "\"binary_data_size\":9,",
    "{\"name\":\"image\",\"shape\":[1],\"datatype\":\"BYTES\",\"parameters\":{\"binary_data_size\":1}},",
    "{\"name\":\"boxes\",\"parameters\":{\"binary_data\":true}},",
    "\\u0041",
];

async fn time(service: &Service, path: &str, content_type: &str, body: String) -> Duration {
    let mut request = Request::post(path).header("content-type", content_type);
    let mut body = body;
    if let Some(length) = body.find(HEAD_END) {
        body.remove(length);
        request = request.header("inference-header-content-length", length);
    }
    let request = with_host(request.body(Body::from(body)).unwrap());
    let began = Instant::now();
    let answer = service.send(request).await;
    assert!(answer.status.is_client_error(), "{}", answer.text());
    began.elapsed()
}

async fn grows_linearly(path: &str, content_type: &str, bodies: &[&str], fillers: &[&str]) {
    let service = Service::within(&Bounds::default());
    for body in bodies {
        for filler in fillers {
            let filled = |bytes: usize| {
                let count = bytes / filler.len();
                let filler: String = if filler.contains('#') {
                    let numbered = |number: usize| filler.replace('#', &number.to_string());
                    (0..count).map(numbered).collect()
                } else {
                    filler.repeat(count)
                };
                body.replace(PLACE, &filler)
            };
            let (mut small, mut large) = (Duration::MAX, Duration::MAX);
            let mut ratio = f64::INFINITY;
            for _ in 0..ROUNDS {
                let (less, more) = (filled(BYTES / GROWTH), filled(BYTES));
                small = small.min(time(&service, path, content_type, less).await.max(LEAST));
                large = large.min(time(&service, path, content_type, more).await);
                ratio = large.as_secs_f64() / small.as_secs_f64();
                if ratio <= MAX_RATIO {
                    break;
                }
            }
            assert!(ratio <= MAX_RATIO, "{ratio:.0} for {filler:?} in {body:?}");
        }
    }
}

#[tokio::test]
async fn reading_time_grows_linearly_with_a_form() {
    grows_linearly("/detect", FORM, &FORMS, &FORM_FILLERS).await;
}

#[tokio::test]
async fn reading_time_grows_linearly_with_tensors() {
    let path = "/v2/models/lookdown/infer";
    grows_linearly(path, "application/json", &TENSORS, &TENSOR_FILLERS).await;
}

#[tokio::test]
async fn reading_time_grows_linearly_with_binary_tensors() {
    let path = "/v2/models/lookdown/infer";
    let content_type = "application/octet-stream";
    grows_linearly(path, content_type, &BINARY_TENSORS, &BINARY_FILLERS).await;
}
