"""The pictures of ``openphase paper``: drawn so that one can lay them beside the paper's."""
