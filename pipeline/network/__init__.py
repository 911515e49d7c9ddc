"""GA-CNN: the network, its family, its training, its figures; Supplement IV."""
