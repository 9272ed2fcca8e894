//! The nodes of a Redis Cluster. All keys of an installation are in one hash slot, so it uses the
//! one node that serves the slot: the redirection of any node names it. The client library's
//! cluster client opens its own connections, which cannot bound replies.

use parking_lot::Mutex;
use redis::{RedisResult, Value, aio::MultiplexedConnection, cmd};

use super::{connect::Connector, keys::Keys, node::Node, reading::Reader};
use crate::results::ReportId;

/// Most redirections that one attempt follows.
const MOST_REDIRECTIONS: usize = 4;
/// Most nodes that are remembered.
const MOST_NODES: usize = 16;

/// A connection to the node that serves the slot of the installation.
pub(super) struct Serving {
    pub(super) node: Node,
    pub(super) connection: MultiplexedConnection,
    /// The newest ID that was ever assigned.
    pub(super) newest: ReportId,
}

/// The nodes that were seen in the cluster, if it is one.
#[derive(Default)]
pub(super) struct Nodes(Mutex<Vec<Node>>);

impl Nodes {
    /// Connects to the node that serves the slot, by way of the configured node or any other of the
    /// cluster.
    pub(super) async fn connect(&self, connector: &Connector, keys: &Keys) -> RedisResult<Serving> {
        let mut outcome = follow_redirections(connector, connector.node(), keys).await;
        let known = self.0.lock().clone();
        for node in known {
            if outcome.is_ok() {
                break;
            }
            let next = follow_redirections(connector, node, keys).await;
            // The reason that counts is that of the configured node.
            outcome = next.or(outcome);
        }
        let mut serving = outcome?;
        let found = nodes_of_cluster(&mut serving.connection, &serving.node).await;
        if !found.is_empty() {
            *self.0.lock() = found;
        }
        Ok(serving)
    }
}

async fn follow_redirections(
    connector: &Connector,
    mut node: Node,
    keys: &Keys,
) -> RedisResult<Serving> {
    let mut redirections = 0;
    loop {
        let connection = connector.connect(&node).await?;
        let mut reader = Reader {
            connection: connection.clone(),
            keys,
        };
        match reader.newest().await {
            Ok(newest) => {
                return Ok(Serving {
                    node,
                    connection,
                    newest,
                });
            }
            Err(error) => match node.redirected(&error) {
                Some(next) if redirections < MOST_REDIRECTIONS => {
                    redirections += 1;
                    node = next;
                }
                _ => return Err(error),
            },
        }
    }
}

/// The nodes of the cluster. Empty for a Redis that is not a cluster.
async fn nodes_of_cluster(connection: &mut MultiplexedConnection, asked: &Node) -> Vec<Node> {
    let slots: RedisResult<Value> = cmd("CLUSTER").arg("SLOTS").query_async(connection).await;
    let mut nodes = Vec::new();
    for node in slots.iter().flat_map(|slots| nodes_of(slots, asked)) {
        if !nodes.contains(&node) && nodes.len() < MOST_NODES {
            nodes.push(node);
        }
    }
    nodes
}

/// The nodes in a reply to `CLUSTER SLOTS`: for each range its first and last slot, then its nodes
/// by host, port and more.
fn nodes_of(slots: &Value, asked: &Node) -> Vec<Node> {
    let mut nodes = Vec::new();
    for range in items(slots) {
        for node in items(range).iter().skip(2) {
            if let [host, Value::Int(port), ..] = items(node)
                && let Ok(port) = u16::try_from(*port)
            {
                let host = match host {
                    Value::BulkString(host) if !host.is_empty() => str::from_utf8(host).ok(),
                    // A node that does not know its own address.
                    _ => Some(asked.host.as_str()),
                };
                nodes.extend(host.map(|host| Node::new(host, port)));
            }
        }
    }
    nodes
}

fn items(value: &Value) -> &[Value] {
    match value {
        Value::Array(items) => items,
        _ => &[],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked() -> Node {
        Node::new("redis", 7000)
    }

    #[test]
    fn nodes_are_read_from_the_slots_of_a_cluster() {
        let reply = "*2\r\n*4\r\n:0\r\n:8000\r\n*3\r\n$8\r\n10.0.0.2\r\n:7001\r\n$1\r\na\r\n\
                     *2\r\n$0\r\n\r\n:7002\r\n*3\r\n:8001\r\n:16383\r\n*2\r\n$-1\r\n:70000\r\n";
        let slots = redis::parse_redis_value(reply.as_bytes()).unwrap();
        let nodes = nodes_of(&slots, &asked());
        let nodes: Vec<_> = nodes.iter().map(ToString::to_string).collect();
        assert_eq!(nodes, ["10.0.0.2:7001", "redis:7002"]);
        assert!(nodes_of(&Value::Okay, &asked()).is_empty());
    }
}
