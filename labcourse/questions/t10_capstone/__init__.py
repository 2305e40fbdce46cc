"""Topic 10, the capstone, has no questions: a person grades its texts by the rubrics in its solution."""
