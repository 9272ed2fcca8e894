"""Tools of `test_kubernetes.py`: those of a cluster, and schemas of custom resources."""
