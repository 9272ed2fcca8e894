//! A camera of the test, and a client in the place of `ffmpeg`.

use std::time::Duration;

use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::{TcpListener, TcpStream},
    time::timeout,
};

use super::*;
use crate::Credentials;

const DIGEST: &str = "RTSP/1.0 401 Unauthorized\r\nWWW-Authenticate: Basic realm=\"c\"\r\n\
    WWW-Authenticate: Digest realm=\"c\", nonce=\"n\"\r\n";
const BASIC: &str = "RTSP/1.0 401 Unauthorized\r\nWWW-Authenticate: Basic realm=\"c\"\r\n";
const PATIENCE: Duration = Duration::from_secs(20);

/// A header of the answers after which the camera closes the connection.
const CLOSES: &str = "X-Closes: yes\r\n";

/// The answers of a camera to its requests, one after another, without their `CSeq`. Returns the
/// URL, and the requests at the end.
async fn camera(answers: &[&str]) -> (Url, tokio::task::JoinHandle<Vec<String>>) {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let port = listener.local_addr().unwrap().port();
    let answers: Vec<_> = answers.iter().map(|&answer| answer.to_owned()).collect();
    let serving = tokio::spawn(async move {
        let (mut connection, _) = listener.accept().await.unwrap();
        let mut requests = Vec::new();
        for answer in answers {
            let Some(request) = read_head(&mut connection).await else {
                break;
            };
            let sequence = request
                .lines()
                .find(|line| line.starts_with("CSeq"))
                .unwrap();
            let (start, rest) = answer.split_once("\r\n").unwrap();
            let answer = format!("{start}\r\n{sequence}\r\n{rest}\r\n");
            requests.push(request);
            connection.write_all(answer.as_bytes()).await.unwrap();
            if answer.contains(CLOSES) {
                drop(connection);
                (connection, _) = listener.accept().await.unwrap();
            }
        }
        // What follows the answers.
        if let Ok(Some(request)) =
            timeout(Duration::from_millis(50), read_head(&mut connection)).await
        {
            requests.push(request);
        }
        requests
    });
    let url = format!("rtsp://127.0.0.1:{port}/stream?x=1");
    (url.parse().unwrap(), serving)
}

async fn read_head(connection: &mut TcpStream) -> Option<String> {
    let mut head = Vec::new();
    while !head.ends_with(b"\r\n\r\n") {
        head.push(connection.read_u8().await.ok()?);
    }
    Some(String::from_utf8(head).unwrap())
}

fn login() -> Login {
    Login::new(Some(Credentials {
        user: "viewer".to_owned(),
        password: "geheim".into(),
    }))
}

/// Sends requests for the URL of the relay. Returns the answers, and the error that ends the relay.
async fn exchange(
    url: &Url,
    login: &mut Login,
    requests: &[&str],
) -> (Vec<String>, Option<SourceError>) {
    let relay = Relay::connect(url, PATIENCE).await.unwrap();
    let inner: Url = relay.url().parse().unwrap();
    let mut answers = Vec::new();
    let client = async {
        let port = inner.port().unwrap();
        let mut connection = TcpStream::connect(("127.0.0.1", port)).await.unwrap();
        for request in requests {
            let request = request.replace("URL", inner.as_str());
            connection.write_all(request.as_bytes()).await.unwrap();
            match read_head(&mut connection).await {
                Some(answer) => answers.push(answer),
                None => std::future::pending().await,
            }
        }
    };
    let ended = tokio::select! {
        error = relay.run(login) => Some(error),
        () = client => None,
        () = tokio::time::sleep(PATIENCE) => panic!("the relay waits"),
    };
    (answers, ended)
}

#[tokio::test]
async fn a_redirection_ends_the_relay_and_sends_no_password() {
    let found = "RTSP/1.0 302 Found\r\nLocation: rtsp://127.0.0.1:1/internal\r\n";
    let (url, serving) = camera(&[found]).await;
    let request = "DESCRIBE URL RTSP/1.0\r\nCSeq: 9\r\n\r\n";
    let (answers, error) = exchange(&url, &mut login(), &[request]).await;
    assert!(matches!(error, Some(SourceError::Redirect)), "{error:?}");
    assert!(answers.is_empty(), "{answers:?}");
    let requests = serving.await.unwrap();
    assert!(!requests.concat().contains("Authorization"), "{requests:?}");
}

#[tokio::test]
async fn a_request_of_the_camera_to_redirect_ends_the_relay() {
    let answer = "RTSP/1.0 200 OK\r\n\r\nREDIRECT * RTSP/1.0\r\nLocation: rtsp://127.0.0.1:1/\r\n";
    let (url, _serving) = camera(&[answer]).await;
    let requests = ["OPTIONS URL RTSP/1.0\r\nCSeq: 1\r\n\r\n"; 2];
    let (_, error) = exchange(&url, &mut login(), &requests).await;
    assert!(matches!(error, Some(SourceError::Redirect)), "{error:?}");
}

#[tokio::test]
async fn the_relay_answers_a_challenge_with_digest_only() {
    let (url, serving) = camera(&[DIGEST, "RTSP/1.0 200 OK\r\n", "RTSP/1.0 200 OK\r\n"]).await;
    let mut login = login();
    let requests = [
        "DESCRIBE URL RTSP/1.0\r\nCSeq: 41\r\n\r\n",
        "SETUP URL/track1 RTSP/1.0\r\nCSeq: 42\r\n\r\n",
    ];
    let (answers, error) = exchange(&url, &mut login, &requests).await;
    assert!(error.is_none(), "{error:?}");
    for (answer, number) in answers.iter().zip(["41", "42"]) {
        assert!(answer.starts_with("RTSP/1.0 200 OK"), "{answer}");
        assert!(answer.contains(&format!("CSeq: {number}\r\n")), "{answer}");
    }
    let requests = serving.await.unwrap();
    assert_eq!(requests.len(), 3);
    assert!(requests[0].starts_with(&format!("DESCRIBE {url} RTSP/1.0\r\n")));
    assert!(!requests[0].contains("Authorization"));
    assert!(requests[1].contains("Authorization: Digest username=\"viewer\""));
    assert!(requests[2].starts_with(&format!("SETUP {url}/track1 RTSP/1.0\r\n")));
    assert!(!requests.concat().contains("geheim"));
    // The same camera asks for the password in plain text later.
    login.restart();
    let (url, serving) = camera(&[BASIC]).await;
    let request = "DESCRIBE URL RTSP/1.0\r\nCSeq: 1\r\n\r\n";
    let (_, error) = exchange(&url, &mut login, &[request]).await;
    assert!(
        matches!(error, Some(SourceError::BasicAfterDigest)),
        "{error:?}"
    );
    assert_eq!(serving.await.unwrap().len(), 1);
}

#[tokio::test]
async fn a_wrong_password_is_sent_once() {
    let (url, serving) = camera(&[BASIC, BASIC]).await;
    let request = "DESCRIBE URL RTSP/1.0\r\nCSeq: 1\r\n\r\n";
    let (_, error) = exchange(&url, &mut login(), &[request]).await;
    let is_refused = matches!(error, Some(SourceError::CredentialsRefused { .. }));
    assert!(is_refused, "{error:?}");
    assert_eq!(serving.await.unwrap().len(), 2);
}

#[tokio::test]
async fn large_descriptions_end_the_relay() {
    let large = "RTSP/1.0 200 OK\r\nContent-Length: 6400000\r\n";
    let (url, _serving) = camera(&[large]).await;
    let request = "DESCRIBE URL RTSP/1.0\r\nCSeq: 1\r\n\r\n";
    let (_, error) = exchange(&url, &mut login(), &[request]).await;
    assert!(matches!(error, Some(SourceError::Stream(_))), "{error:?}");
}

#[tokio::test]
async fn messages_that_answer_no_request_end_the_relay() {
    for message in [
        "RTSP/1.0 100 Continue\r\n\r\n",
        "OPTIONS * RTSP/1.0\r\n\r\n",
    ] {
        let answer = format!("RTSP/1.0 200 OK\r\n\r\n{}", message.repeat(101));
        let (url, _serving) = camera(&[&answer]).await;
        let requests = ["OPTIONS URL RTSP/1.0\r\nCSeq: 1\r\n\r\n"; 2];
        let (_, error) = exchange(&url, &mut login(), &requests).await;
        let is_flood =
            matches!(&error, Some(SourceError::Stream(problem)) if problem.contains("100 RTSP"));
        assert!(is_flood, "{message}: {error:?}");
    }
}

#[tokio::test]
async fn connections_without_the_token_get_nothing() {
    let (url, _serving) = camera(&["RTSP/1.0 200 OK\r\n"]).await;
    let relay = Relay::connect(&url, PATIENCE).await.unwrap();
    let port = relay.url().parse::<Url>().unwrap().port().unwrap();
    let stranger = async {
        let mut connection = TcpStream::connect(("127.0.0.1", port)).await.unwrap();
        let request = b"DESCRIBE rtsp://127.0.0.1/other RTSP/1.0\r\nCSeq: 1\r\n\r\n";
        connection.write_all(request).await.unwrap();
        read_head(&mut connection).await
    };
    let mut login = login();
    let answer = tokio::select! {
        error = relay.run(&mut login) => panic!("{error}"),
        answer = stranger => answer,
    };
    assert_eq!(answer, None);
}

#[tokio::test]
async fn a_camera_that_closes_after_the_challenge_is_asked_again() {
    let closes = format!("{DIGEST}{CLOSES}");
    let request = "DESCRIBE URL RTSP/1.0\r\nCSeq: 1\r\n\r\n";
    let (url, serving) = camera(&[&closes, "RTSP/1.0 200 OK\r\n"]).await;
    let (answers, error) = exchange(&url, &mut login(), &[request]).await;
    assert!(error.is_none(), "{error:?}");
    assert!(answers[0].starts_with("RTSP/1.0 200 OK"), "{answers:?}");
    let requests = serving.await.unwrap();
    assert!(
        requests[1].contains("Authorization: Digest"),
        "{requests:?}"
    );
    // A camera that has gone then.
    let (url, _serving) = camera(&[DIGEST]).await;
    let (_, error) = exchange(&url, &mut login(), &[request]).await;
    let is_closed = matches!(error, Some(SourceError::ClosedAfterChallenge));
    assert!(is_closed, "{error:?}");
}
