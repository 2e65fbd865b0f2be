"""A baseline after ACROSS (2025): its published network shapes, here on our surfaces, to be measured beside ours.

A mesh is encoded by Chebyshev graph convolutions (Defferrard et al. 2016) on meshes that are halved four times, as in
CoMA (Ranjan et al. 2018); signal and mesh latents are joined by plain perceptrons. Sizes: docs/sources.md; what
is not published and taken here as it suits the baseline best: ReLU in the mesh networks, halving by collapsing the
shortest edges, displacements over one rms, signals compressed and roughened as for our networks.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from tactile_core.geometry.lattice import Lattice

ORDER = 6  # K, terms of Chebyshev's series
FILTERS = 3, 16, 16, 16, 32
DENSE, MESH_LATENT, SIGNAL_LATENT = 512, 128, 8
SIGNAL_SIZES = 19, 256, 128, 64
S2MPN = (SIGNAL_LATENT, 512, 128, 256, 256, MESH_LATENT), (0.4, 0.3, 0.2, 0.5)
M2MPN = (MESH_LATENT, 512, 1024, 1024, 256, MESH_LATENT), (0.2, 0.4, 0.0, 0.0)


def halved(places: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (m,) that stay and the triangles between them: shortest edges collapse until half of the nodes are gone."""
    goal, merged = len(places) // 2, np.arange(len(places))
    while len(np.unique(merged)) > goal:
        surplus, free = len(np.unique(merged)) - goal, np.ones(len(places), bool)
        edges = edges_of(merged[faces])
        length = np.linalg.norm(places[edges[:, 0]] - places[edges[:, 1]], axis=1)
        for a, b in edges[np.argsort(length, kind="stable")]:
            if surplus and free[a] and free[b]:
                free[[a, b]], surplus = False, surplus - 1
                merged[merged == b] = a
    kept, number = np.unique(merged, return_inverse=True)
    triangles = number[faces]
    whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return kept, triangles[whole]


def edges_of(faces: np.ndarray) -> np.ndarray:
    """Edges (e, 2) of triangles, each once; those that collapsed have none."""
    pairs = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    return np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)


def raised(fine: np.ndarray, coarse: np.ndarray, faces: np.ndarray) -> Tensor:
    """Sparse (n, m) that carries values from coarse to fine nodes: barycentric in the triangle that lies nearest."""
    import trimesh

    mesh = trimesh.Trimesh(coarse, faces, process=False)
    points, _, triangle = trimesh.proximity.closest_point(mesh, fine)
    weights = trimesh.triangles.points_to_barycentric(mesh.triangles[triangle], points, method="cross")
    rows = np.repeat(np.arange(len(fine)), 3)
    return sparse(rows, mesh.faces[triangle].ravel(), weights.ravel(), (len(fine), len(coarse)))


def sparse(rows: np.ndarray, columns: np.ndarray, values: np.ndarray, shape: tuple[int, int]) -> Tensor:
    """A CSR matrix, float32."""
    at = torch.from_numpy(np.stack([rows, columns]).astype(np.int64))
    return torch.sparse_coo_tensor(at, torch.from_numpy(values.astype(np.float32)), shape).coalesce().to_sparse_csr()


def scaled_laplacian(count: int, faces: np.ndarray) -> Tensor:
    """2 L / 2 - 1 of the normalised Laplacian, whose largest eigenvalue is taken as 2: minus the scaled adjacency."""
    edges = edges_of(faces)
    rows, columns = np.concatenate([edges, edges[:, ::-1]]).T
    degree = np.bincount(rows, minlength=count)
    return sparse(rows, columns, -1 / np.sqrt(degree[rows] * degree[columns]), (count, count))


class Apply(torch.autograd.Function):
    """A fixed sparse matrix times a dense one; its transpose carries the gradient."""

    @staticmethod
    def forward(ctx: Any, matrix: Tensor, turned: Tensor, x: Tensor) -> Tensor:
        """(n, m) sparse, its transpose, (m, c) -> (n, c)."""
        ctx.turned = turned
        return matrix @ x

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[None, None, Tensor]:
        """Return the gradient of x alone: the matrix is constant."""
        return None, None, ctx.turned @ gradient.contiguous()


class Fixed:
    """A sparse matrix with its transpose, applied along the nodes of (n, B, c)."""

    def __init__(self, matrix: Tensor) -> None:
        self.matrix, self.turned = matrix, matrix.to_sparse_coo().t().coalesce().to_sparse_csr()

    def __call__(self, x: Tensor) -> Tensor:
        """(m, B, c) -> (n, B, c)."""
        return Apply.apply(self.matrix, self.turned, x.reshape(len(x), -1)).reshape(-1, *x.shape[1:])


class Chebyshev(nn.Module):
    """sum over k < ORDER of T_k(L) x W_k + bias; Clenshaw's recurrence where there are fewer outputs than inputs."""

    def __init__(self, laplacian: Fixed, inputs: int, outputs: int) -> None:
        super().__init__()
        self.laplacian, self.outputs = laplacian, outputs
        self.mix = nn.Linear(ORDER * inputs, outputs)

    def forward(self, x: Tensor) -> Tensor:
        """(n, B, inputs) -> (n, B, outputs)."""
        if self.outputs < x.shape[-1]:
            weights = self.mix.weight.reshape(self.outputs, ORDER, -1)
            parts = (x @ weights.reshape(self.outputs * ORDER, -1).T).unflatten(-1, (self.outputs, ORDER)).unbind(-1)
            later, last = torch.zeros_like(parts[0]), parts[-1]
            for part in parts[-2:0:-1]:
                later, last = last, part + 2 * self.laplacian(last) - later
            return parts[0] + self.laplacian(last) - later + self.mix.bias
        terms = [x, self.laplacian(x)]
        while len(terms) < ORDER:
            terms.append(2 * self.laplacian(terms[-1]) - terms[-2])
        return self.mix(torch.cat(terms, -1))


class MeshVae(nn.Module):
    """MVB or MVD: displacement (B, n, 3), over one rms, to a latent of 128 and back."""

    def __init__(self, surface: Lattice) -> None:
        super().__init__()
        places, faces, convolve, self.down, self.up = surface.rest, surface.faces, [], [], []
        for _ in FILTERS[1:]:
            convolve.append(Fixed(scaled_laplacian(len(places), faces)))
            kept, faces = halved(places, faces)
            self.down.append(torch.from_numpy(kept))
            self.up.append(Fixed(raised(places, places[kept], faces)))
            places = places[kept]
        self.coarsest = len(places)
        self.encoder = nn.ModuleList(
            Chebyshev(laplacian, a, b) for laplacian, a, b in zip(convolve, FILTERS, FILTERS[1:], strict=False)
        )
        self.decoder = nn.ModuleList(
            Chebyshev(laplacian, b, a) for laplacian, a, b in zip(convolve, FILTERS, FILTERS[1:], strict=False)
        )
        flat = self.coarsest * FILTERS[-1]
        self.narrow = nn.Sequential(nn.Linear(flat, DENSE), nn.ReLU(), nn.Linear(DENSE, 2 * MESH_LATENT))
        self.widen = nn.Sequential(nn.Linear(MESH_LATENT, DENSE), nn.ReLU(), nn.Linear(DENSE, flat), nn.ReLU())

    def posterior(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """(B, n, 3) -> mean and log variance (B, 128)."""
        x = x.transpose(0, 1)
        for convolution, kept in zip(self.encoder, self.down, strict=True):
            x = torch.relu(convolution(x))[kept]
        return self.narrow(x.transpose(0, 1).flatten(1)).chunk(2, -1)

    def decode(self, latent: Tensor) -> Tensor:
        """(B, 128) -> (B, n, 3)."""
        x = self.widen(latent).unflatten(-1, (self.coarsest, FILTERS[-1])).transpose(0, 1)
        for number in reversed(range(len(self.decoder))):
            x = self.decoder[number](self.up[number](x))
            x = torch.relu(x) if number else x
        return x.transpose(0, 1)


class SignalVae(nn.Module):
    """SVB: 19-256-128-64 to a latent of 8, mirrored."""

    def __init__(self) -> None:
        super().__init__()
        self.encoder = perceptron((*SIGNAL_SIZES, 2 * SIGNAL_LATENT), nn.ReLU)
        self.decode = perceptron((SIGNAL_LATENT, *SIGNAL_SIZES[::-1]), nn.ReLU)

    def posterior(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """(B, 19) -> mean and log variance (B, 8)."""
        return self.encoder(x).chunk(2, -1)


def perceptron(sizes: tuple[int, ...], activation: type[nn.Module], dropout: tuple[float, ...] = ()) -> nn.Sequential:
    """Linear layers with the activation, and dropout, between them."""
    layers: list[nn.Module] = []
    for number, (a, b) in enumerate(zip(sizes, sizes[1:], strict=False)):
        layers += [nn.Linear(a, b), activation(), nn.Dropout(dropout[number] if number < len(dropout) else 0.0)]
    return nn.Sequential(*layers[:-2])


class Across(nn.Module):
    """Hold all five networks, and translate signals to both displacements in units of ``rms`` (2,) m."""

    def __init__(self, biotac: Lattice, digit: Lattice) -> None:
        super().__init__()
        self.SVB, self.MVB, self.MVD = SignalVae(), MeshVae(biotac), MeshVae(digit)
        self.S2MPN, self.M2MPN = (perceptron(sizes, nn.ELU, dropout) for sizes, dropout in (S2MPN, M2MPN))

    def forward(self, signal: Tensor) -> tuple[Tensor, Tensor]:
        """Compressed changes (B, 19) -> displacements (B, N, 3), (B, M, 3) over their rms."""
        biotac = self.S2MPN(self.SVB.posterior(signal)[0])
        return self.MVB.decode(biotac), self.MVD.decode(self.M2MPN(biotac))


def untrained(biotac: Lattice, digit: Lattice) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Compressed changes (B, 19) -> both displacements, by weights as they were drawn: to measure time and memory."""
    model = Across(biotac, digit).eval()

    @torch.inference_mode()
    def surfaces(signal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        on_biotac, on_digit = model(torch.from_numpy(signal))
        return on_biotac.numpy(), on_digit.numpy()

    return surfaces
