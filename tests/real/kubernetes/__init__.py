"""What `test_kubernetes.py` looks with: the cluster's own tools, and what is known of custom resources."""
