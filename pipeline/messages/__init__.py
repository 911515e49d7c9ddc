"""Domain types to protobuf messages and back, one module a stage."""
