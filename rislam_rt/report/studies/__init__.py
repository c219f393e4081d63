"""Pages, tables and figures of single studies (channel comparison, Fig. 4(a), claims, classifier) and of a sweep."""
