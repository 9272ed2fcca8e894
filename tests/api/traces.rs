//! Traces, as an OTLP collector receives them.

use std::{
    collections::BTreeMap,
    fmt::Write,
    sync::{
        Arc, Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    time::{Duration, Instant},
};

use axum::{Router, body::Bytes, http::Request, http::StatusCode, routing::post};
use lookdown::{settings::TraceSettings, telemetry::Tracer};
use opentelemetry_proto::tonic::{
    collector::trace::v1::ExportTraceServiceRequest,
    common::v1::{KeyValue, any_value::Value},
    trace::v1::{Span, span::SpanKind, status::StatusCode as SpanStatus},
};
use prost::Message;
use tokio::{net::TcpListener, task::spawn_blocking};

use crate::service::{Bounds, Service, frame};

const TRACE: &str = "4bf92f3577b34da6a3ce929d0e0e4736";
const PARENT: &str = "00f067aa0ba902b7";

/// Receives spans over HTTP.
#[derive(Clone, Default)]
struct Collector {
    spans: Arc<Mutex<Vec<Span>>>,
    service: Arc<Mutex<Vec<KeyValue>>>,
    deliveries: Arc<AtomicUsize>,
}

impl Collector {
    /// Starts the collector; it answers exports with `status`.
    async fn start(status: StatusCode) -> (Self, TraceSettings) {
        let collector = Self::default();
        let receiving = collector.clone();
        let receive = async move |body: Bytes| {
            receiving.receive(&body);
            status
        };
        let router = Router::new().route("/otlp/v1/traces", post(receive));
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        tokio::spawn(async { axum::serve(listener, router).await });
        (collector, settings(&format!("http://{address}/otlp")))
    }

    fn receive(&self, body: &[u8]) {
        self.deliveries.fetch_add(1, Ordering::Relaxed);
        let delivery = ExportTraceServiceRequest::decode(body).unwrap();
        for group in delivery.resource_spans {
            *self.service.lock().unwrap() = group.resource.unwrap().attributes;
            for scope in group.scope_spans {
                assert_eq!(scope.scope.unwrap().name, "lookdown");
                self.spans.lock().unwrap().extend(scope.spans);
            }
        }
    }

    /// Returns the span of the request, and the spans within it in the order of their start times.
    fn request(&self) -> (Span, Vec<Span>) {
        let spans = self.spans.lock().unwrap().clone();
        let (mut requests, mut stages): (Vec<_>, Vec<_>) = spans
            .into_iter()
            .partition(|span| span.kind() == SpanKind::Server);
        assert_eq!(requests.len(), 1, "{requests:?}");
        stages.sort_by_key(|span| span.start_time_unix_nano);
        (requests.remove(0), stages)
    }
}

fn settings(endpoint: &str) -> TraceSettings {
    TraceSettings {
        otlp_endpoint: Some(endpoint.parse().unwrap()),
        sample_ratio: 1.0,
        service_name: "gate-7".to_owned(),
    }
}

fn service(tracer: &Tracer, request_timeout: Duration) -> Service {
    Service::within(&Bounds {
        tracer: tracer.clone(),
        request_timeout,
        ..Bounds::default()
    })
}

async fn flush(tracer: Tracer) {
    spawn_blocking(move || tracer.shut_down()).await.unwrap();
}

fn detect(parent: Option<&str>) -> Request<axum::body::Body> {
    let request = Request::post("/detect?calibration=lobby&profile=quality");
    let request = match parent {
        Some(parent) => request
            .header("traceparent", parent)
            .header("tracestate", "vendor=opaque"),
        None => request,
    };
    request.body(frame().into()).unwrap()
}

fn hexadecimal(id: &[u8]) -> String {
    id.iter().fold(String::new(), |mut digits, byte| {
        write!(digits, "{byte:02x}").unwrap();
        digits
    })
}

fn nanos(span: &Span) -> u64 {
    span.end_time_unix_nano - span.start_time_unix_nano
}

fn attributes(attributes: &[KeyValue]) -> BTreeMap<&str, String> {
    let recorded = attributes.iter().map(|attribute| {
        let value = match attribute.value.as_ref().unwrap().value.as_ref().unwrap() {
            Value::StringValue(text) => text.clone(),
            Value::IntValue(number) => number.to_string(),
            other => panic!("{other:?}"),
        };
        (attribute.key.as_str(), value)
    });
    recorded.collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_request_has_a_span_in_the_trace_of_its_caller() {
    let (collector, settings) = Collector::start(StatusCode::OK).await;
    let tracer = Tracer::start(&settings).unwrap();
    let service = service(&tracer, Duration::from_secs(20));
    let answer = service
        .send(detect(Some(&format!("00-{TRACE}-{PARENT}-01"))))
        .await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    flush(tracer).await;

    let (request, stages) = collector.request();
    assert_eq!(request.name, "POST /detect");
    assert_eq!(hexadecimal(&request.trace_id), TRACE);
    assert_eq!(hexadecimal(&request.parent_span_id), PARENT);
    assert_eq!(request.trace_state, "vendor=opaque");
    let recorded = attributes(&request.attributes);
    for (key, value) in [
        ("http.request.method", "POST"),
        ("http.route", "/detect"),
        ("http.response.status_code", "200"),
        ("lookdown.calibration", "lobby"),
        ("lookdown.profile", "quality"),
        ("lookdown.model", "eager"),
        ("lookdown.request_id", answer.header("x-request-id")),
    ] {
        assert_eq!(recorded[key], value, "{key}");
    }
    let service = collector.service.lock().unwrap().clone();
    let service = attributes(&service);
    assert_eq!(service["service.name"], "gate-7");
    assert_eq!(service["service.version"], env!("CARGO_PKG_VERSION"));

    let names: Vec<_> = stages.iter().map(|span| span.name.as_str()).collect();
    assert_eq!(
        names,
        [
            "upload",
            "queue",
            "decode",
            "calibrate",
            "queue",
            "remap",
            "inference", // The crops.
            "refine",
            "remap",
            "queue",
            "remap",
            "inference",
            "refine",
        ]
    );
    let report = answer.json();
    let mut recorded = BTreeMap::<&str, u64>::new();
    for stage in &stages {
        assert_eq!(stage.trace_id, request.trace_id);
        assert_eq!(stage.parent_span_id, request.span_id);
        assert!(stage.start_time_unix_nano >= request.start_time_unix_nano);
        assert!(stage.end_time_unix_nano <= request.end_time_unix_nano);
        *recorded.entry(&stage.name).or_default() += nanos(stage);
    }
    for stage in [
        "decode",
        "calibrate",
        "queue",
        "remap",
        "inference",
        "refine",
    ] {
        let reported = report["timings_ms"][stage].as_f64().unwrap();
        #[expect(clippy::cast_precision_loss, reason = "far below 2^52 nanoseconds")]
        let in_trace = recorded[stage] as f64 / 1e6;
        assert!(
            (in_trace - reported).abs() < 0.01,
            "{stage}: {in_trace} {reported}"
        );
    }
    let within = stages.windows(2).all(|pair| {
        // One microsecond for the rounding of two clocks.
        pair[1].start_time_unix_nano + 1000 >= pair[0].end_time_unix_nano
    });
    assert!(within, "stages overlap: {stages:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_trace_of_a_late_frame_has_its_last_stage() {
    let (collector, settings) = Collector::start(StatusCode::OK).await;
    let tracer = Tracer::start(&settings).unwrap();
    let service = service(&tracer, Duration::from_millis(300));
    service.gate.close();
    let answer = service.send(detect(None)).await;
    assert_eq!(answer.status, 504);
    service.gate.open();
    flush(tracer).await;
    let (request, stages) = collector.request();
    assert_eq!(request.status.unwrap().code(), SpanStatus::Error);
    assert_eq!(attributes(&request.attributes)["error.type"], "timeout");
    let last = stages.last().unwrap();
    assert_eq!(last.name, "queue");
    assert!(nanos(last) > 100_000_000, "{last:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn refusals_are_no_span_errors_and_unsampled_callers_are_obeyed() {
    let (collector, settings) = Collector::start(StatusCode::OK).await;
    let tracer = Tracer::start(&settings).unwrap();
    let service = service(&tracer, Duration::from_secs(20));
    let unsampled = format!("00-{TRACE}-{PARENT}-00");
    assert_eq!(service.send(detect(Some(&unsampled))).await.status, 200);
    assert_eq!(service.get("/made/up").await.status, 404);
    flush(tracer).await;
    let (request, stages) = collector.request();
    assert_eq!((request.name.as_str(), stages.len()), ("GET unmatched", 0));
    assert_ne!(hexadecimal(&request.trace_id), TRACE);
    assert_eq!(attributes(&request.attributes)["error.type"], "not-found");
    let status = request.status.unwrap_or_default();
    assert_eq!(status.code(), SpanStatus::Unset);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_unsampled_request_exports_nothing() {
    let (collector, settings) = Collector::start(StatusCode::OK).await;
    let tracer = Tracer::start(&TraceSettings {
        sample_ratio: 0.0,
        ..settings
    });
    let tracer = tracer.unwrap();
    let service = service(&tracer, Duration::from_secs(20));
    assert_eq!(service.send(detect(None)).await.status, 200);
    flush(tracer).await;
    assert_eq!(collector.deliveries.load(Ordering::Relaxed), 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_silent_collector_delays_only_the_shutdown_by_seconds() {
    // The operating system accepts the connections, and no process reads them.
    let silent = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = silent.local_addr().unwrap();
    let tracer = Tracer::start(&settings(&format!("http://{address}"))).unwrap();
    let service = service(&tracer, Duration::from_secs(20));
    // More spans than fit into the queue.
    for _ in 0..3000 {
        let began = Instant::now();
        assert_eq!(service.get("/livez").await.status, 200);
        assert!(began.elapsed() < Duration::from_secs(2));
    }
    let began = Instant::now();
    flush(tracer).await;
    assert!(began.elapsed() < Duration::from_secs(5), "{began:?}");
    service.still_works().await;
}
