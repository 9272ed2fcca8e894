use std::net::TcpListener;

use super::*;
use crate::settings;

fn server(variables: &[(&str, &str)]) -> Settings {
    let variables = variables
        .iter()
        .map(|(key, value)| (format!("LOOKDOWN__SERVER__{key}"), (*value).to_owned()));
    settings::load(None, variables).unwrap()
}

const CERTIFICATE: [(&str, &str); 2] = [
    ("TLS__CERTIFICATE", "server.pem"),
    ("TLS__PRIVATE_KEY", "server.key"),
];

#[test]
fn an_unspecified_address_is_probed_on_the_loopback() {
    let cases = [
        ("0.0.0.0:8080", "http://127.0.0.1:8080/readyz"),
        ("[::]:8080", "http://[::1]:8080/readyz"),
        ("192.0.2.7:80", "http://192.0.2.7:80/readyz"),
    ];
    for (listen, wanted) in cases {
        let server = server(&[("LISTEN", listen)]);
        assert_eq!(url(&server, Probe::Readiness).unwrap(), wanted);
    }
}

#[test]
fn a_server_with_a_certificate_is_probed_over_tls() {
    let server = server(&CERTIFICATE);
    let asked = url(&server, Probe::Liveness).unwrap();
    assert_eq!(asked, "https://127.0.0.1:8080/livez");
}

#[test]
fn the_metrics_port_is_preferred() {
    let mut variables = CERTIFICATE.to_vec();
    variables.push(("METRICS_LISTEN", "0.0.0.0:9090"));
    let asked = url(&server(&variables), Probe::Readiness).unwrap();
    assert_eq!(asked, "http://127.0.0.1:9090/readyz");
}

#[test]
fn port_0_cannot_be_probed() {
    let server = server(&[("LISTEN", "127.0.0.1:0")]);
    let refused = url(&server, Probe::Readiness).unwrap_err();
    assert!(refused.to_string().contains("server.listen"), "{refused}");
}

#[test]
fn the_error_names_required_client_certificates() {
    let mut variables = CERTIFICATE.to_vec();
    variables.push(("TLS__CLIENT_CERTIFICATES", "clients.pem"));
    assert!(hint(&server(&variables)).contains("server.metrics_listen"));
    assert_eq!(hint(&server(&CERTIFICATE)), "");
}

#[tokio::test(start_paused = true)]
async fn the_probe_of_a_silent_server_times_out() {
    // The peer connects and sends nothing. The paused clock advances as soon as all tasks are idle.
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = silent.local_addr().unwrap().to_string();
    let gave_up = ask(&server(&[("LISTEN", &address)]), Probe::Liveness).await;
    let gave_up = gave_up.unwrap_err();
    assert!(gave_up.to_string().contains("does not answer"), "{gave_up}");
}
