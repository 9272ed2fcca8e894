//! A fake server of the Open Inference Protocol with one model and scripted responses.

use std::{
    collections::VecDeque,
    io::{BufRead, BufReader, Read, Write},
    net::{Shutdown, SocketAddr, TcpListener, TcpStream},
    sync::{Arc, Mutex},
};

use serde_json::{Value, json};

/// A server on a local port.
pub(super) struct FakeServer {
    address: SocketAddr,
    state: Arc<Mutex<State>>,
}

struct State {
    as_bytes: bool,
    first_axis: i64,
    is_ready: bool,
    /// Status of every response, instead of the regular response.
    refusal: Option<u16>,
    has_ended: bool,
    /// Metadata of the model, instead of the regular ones.
    metadata: Option<String>,
    /// Scripted responses to the next inference requests.
    replies: VecDeque<ScriptedReply>,
    inferred: Vec<Inferred>,
    /// `Authorization` header of every request, in lower case.
    authorizations: Vec<Option<String>>,
}

/// A received inference request.
#[derive(Clone)]
pub(super) struct Inferred {
    pub(super) path: String,
    pub(super) head_length: Option<usize>,
}

/// A response. Without a status the connection is closed.
#[derive(Default)]
pub(super) struct ScriptedReply {
    status: Option<u16>,
    headers: String,
    body: Vec<u8>,
    is_slow: bool,
}

impl ScriptedReply {
    pub(super) fn status(status: u16) -> Self {
        Self {
            status: Some(status),
            ..Self::default()
        }
    }

    pub(super) fn closed() -> Self {
        Self::default()
    }

    pub(super) fn slow() -> Self {
        Self {
            is_slow: true,
            ..Self::status(200)
        }
    }

    pub(super) fn header(self, name: &str, value: &str) -> Self {
        let headers = format!("{}{name}: {value}\r\n", self.headers);
        Self { headers, ..self }
    }

    pub(super) fn body(self, body: impl Into<Vec<u8>>) -> Self {
        Self {
            body: body.into(),
            ..self
        }
    }
}

impl FakeServer {
    /// Starts a server whose model returns the same person for each view of 32×32 pixels.
    /// `first_axis` is the model's batch axis.
    pub(super) fn start(as_bytes: bool, first_axis: i64) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let state = Arc::new(Mutex::new(State {
            as_bytes,
            first_axis,
            is_ready: true,
            refusal: None,
            has_ended: false,
            metadata: None,
            replies: VecDeque::new(),
            inferred: Vec::new(),
            authorizations: Vec::new(),
        }));
        let shared = Arc::clone(&state);
        let accept = move || {
            for stream in listener.incoming() {
                if shared.lock().unwrap().has_ended {
                    return;
                }
                let (stream, shared) = (stream.unwrap(), Arc::clone(&shared));
                let serve = move || serve(&stream, &shared);
                std::thread::Builder::new()
                    .name("fake-connection".to_owned())
                    .spawn(serve)
                    .unwrap();
            }
        };
        std::thread::Builder::new()
            .name("fake-server".to_owned())
            .spawn(accept)
            .unwrap();
        Self { address, state }
    }

    pub(super) fn address(&self) -> String {
        format!("http://{}", self.address)
    }

    pub(super) fn queue(&self, reply: ScriptedReply) {
        self.state.lock().unwrap().replies.push_back(reply);
    }

    pub(super) fn describe(&self, metadata: String) {
        self.state.lock().unwrap().metadata = Some(metadata);
    }

    pub(super) fn be_ready(&self, is_ready: bool) {
        self.state.lock().unwrap().is_ready = is_ready;
    }

    pub(super) fn refuse_all(&self, status: u16) {
        self.state.lock().unwrap().refusal = Some(status);
    }

    pub(super) fn inferred(&self) -> Vec<Inferred> {
        self.state.lock().unwrap().inferred.clone()
    }

    pub(super) fn authorizations(&self) -> Vec<Option<String>> {
        self.state.lock().unwrap().authorizations.clone()
    }

    /// Stops listening.
    pub(super) fn end(&self) {
        self.state.lock().unwrap().has_ended = true;
        // Wakes the listener so that it ends.
        drop(TcpStream::connect(self.address));
        while TcpStream::connect(self.address).is_ok() {}
    }
}

impl Drop for FakeServer {
    fn drop(&mut self) {
        self.end();
    }
}

/// Serves the requests of a connection.
fn serve(stream: &TcpStream, state: &Mutex<State>) {
    let mut reader = BufReader::new(stream);
    loop {
        let mut lines = Vec::new();
        loop {
            let mut line = String::new();
            if reader.read_line(&mut line).unwrap_or(0) == 0 {
                return;
            }
            if line.trim().is_empty() {
                break;
            }
            lines.push(line.trim().to_ascii_lowercase());
        }
        let header = |name: &str| {
            let mut values = lines.iter().filter_map(|line| line.strip_prefix(name));
            values.next().map(str::trim)
        };
        let number = |name: &str| header(name).map(|value| value.parse::<usize>().unwrap());
        let authorization = header("authorization:").map(str::to_owned);
        state.lock().unwrap().authorizations.push(authorization);
        let mut body = vec![0; number("content-length:").unwrap_or(0)];
        reader.read_exact(&mut body).unwrap();
        let path = lines[0].split(' ').nth(1).unwrap().to_owned();
        let reply = answer(
            &path,
            &body,
            number("inference-header-content-length:"),
            state,
        );
        if reply.is_slow {
            // Waits until the client closes the connection.
            let _ = reader.read_to_end(&mut Vec::new());
            return;
        }
        let Some(status) = reply.status else {
            stream.shutdown(Shutdown::Both).unwrap();
            return;
        };
        let length = reply.body.len();
        let head = format!(
            "HTTP/1.1 {status} X\r\nContent-Length: {length}\r\n{}\r\n",
            reply.headers
        );
        let mut stream = stream;
        if stream
            .write_all(&[head.as_bytes(), &reply.body].concat())
            .is_err()
        {
            return;
        }
    }
}

fn answer(
    path: &str,
    body: &[u8],
    head_length: Option<usize>,
    state: &Mutex<State>,
) -> ScriptedReply {
    let mut state = state.lock().unwrap();
    let json = |value: &Value| ScriptedReply::status(200).body(value.to_string());
    if let Some(status) = state.refusal {
        return ScriptedReply::status(status);
    }
    if path == "/v2/models/there"
        && let Some(metadata) = &state.metadata
    {
        return ScriptedReply::status(200).body(metadata.as_str());
    }
    match path {
        "/v2" => json(
            &json!({ "extensions": if state.as_bytes { vec!["binary_tensor_data"] } else { vec![] } }),
        ),
        "/v2/models/there" => json(&json!({
            "name": "there",
            "inputs": [{ "name": "images", "datatype": "FP32", "shape": [state.first_axis, 3, 32, 32] }],
            "outputs": [
                { "name": "boxes", "datatype": "FP32", "shape": [-1, 1, 4] },
                { "name": "scores", "datatype": "FP32", "shape": [-1, 1] },
                { "name": "ids", "datatype": "INT64", "shape": [-1, 1] }
            ]
        })),
        "/v2/models/there/ready" => ScriptedReply::status(if state.is_ready { 200 } else { 400 }),
        _ => {
            state.inferred.push(Inferred {
                path: path.to_owned(),
                head_length,
            });
            let reply = state.replies.pop_front();
            reply.unwrap_or_else(|| found(body, head_length))
        }
    }
}

/// A response with the same person in each view, as bytes if the views were sent as bytes.
fn found(body: &[u8], head_length: Option<usize>) -> ScriptedReply {
    let (head, behind) = body.split_at(head_length.unwrap_or(body.len()));
    let head: Value = serde_json::from_slice(head).unwrap();
    let input = &head["inputs"][0];
    let views = usize::try_from(input["shape"][0].as_u64().unwrap()).unwrap();
    let values = views * 3 * 32 * 32;
    let sent = input["data"].as_array().map_or(behind.len() / 4, Vec::len);
    assert_eq!(sent, values, "as many values as the shape declares");
    let boxes = [1.0_f32, 2.0, 3.0, 4.0].repeat(views);
    let scores = [0.5_f32].repeat(views);
    let output = |name: &str, shape: Value, values: &[f32]| match head_length {
        Some(_) => json!({ "name": name, "datatype": "FP32", "shape": shape,
            "parameters": { "binary_data_size": 4 * values.len() } }),
        None => json!({ "name": name, "datatype": "FP32", "shape": shape, "data": values }),
    };
    let outputs = [
        output("boxes", json!([views, 1, 4]), &boxes),
        output("scores", json!([views, 1]), &scores),
    ];
    let reply = json!({ "model_name": "there", "outputs": outputs }).to_string();
    if head_length.is_none() {
        return ScriptedReply::status(200).body(reply);
    }
    let bytes = boxes
        .iter()
        .chain(&scores)
        .flat_map(|value| value.to_le_bytes());
    let length = reply.len().to_string();
    let body: Vec<_> = reply.bytes().chain(bytes).collect();
    ScriptedReply::status(200)
        .header("Inference-Header-Content-Length", &length)
        .body(body)
}
