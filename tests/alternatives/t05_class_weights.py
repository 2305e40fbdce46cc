"""Right answers to the questions of 05_class_weights, written in other ways than the references."""


def change_prior__torch(z, w, shares, new_shares):
    import torch

    ratio = torch.from_numpy(new_shares / shares / w)
    return torch.log_softmax(torch.from_numpy(z) + ratio.log(), dim=-1).numpy()
